/* In place of Simulink: three samples of one block, with the pose given as arguments.
 * Arguments: address, camera, spacecraft, height, width, 13 numbers. */
#include <stdio.h>

int mxGetString(const mxArray *parameter, char *text, size_t size) {
    return snprintf(text, size, "%s", parameter->text) >= (int)size;
}

int main(int count, char **words) {
    SimStruct S = {0};
    char hash[33];
    if (count != 19) return 2;
    for (int i = 0; i < 3; ++i) S.parameters[i].text = words[1 + i];
    for (int i = 0; i < 2; ++i) S.parameters[3].numbers[i] = atof(words[4 + i]);
    for (int i = 0; i < 13; ++i) S.input[i] = atof(words[6 + i]);
    S.parameters[4].numbers[0] = 0.5;
    mdlInitializeSizes(&S);
    mdlInitializeSampleTimes(&S);
    if (S.expected != 5 || S.width != 13 || !S.contiguous || S.type != SS_UINT16) return 3;
    const size_t pixels = (size_t)S.rows * S.columns;
    uint16_t *row_by_row = calloc(pixels, 2);
    S.output = calloc(pixels, 2);
    mdlStart(&S);
    for (int sample = 0; sample < 3 && S.error == NULL; ++sample) {
        S.time = sample * S.sample_time;
        mdlOutputs(&S, 0);
        const uint16_t *column_by_column = S.output;
        for (int row = 0; row < S.rows; ++row)
            for (int column = 0; column < S.columns; ++column)
                row_by_row[row * S.columns + column] = column_by_column[column * S.rows + row];
        simgl_plane_hash(row_by_row, pixels, hash);
        if (S.error == NULL) puts(hash);
    }
    if (S.error != NULL) printf("error: %s\n", S.error);
    mdlTerminate(&S);
    free(row_by_row);
    free(S.output);
    return 0;
}
