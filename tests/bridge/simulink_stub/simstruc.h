/* What bridge/cpp/simulink/simgl_sfun.c uses of Simulink, in our own words: enough to run it in a
 * test. Names and meanings as in the documentation of level-2 S-functions. */
#ifndef SIMSTRUC_H
#define SIMSTRUC_H

#include <stddef.h>

typedef double real_T;
typedef int int_T;
enum { SS_UINT16 = 5 };
/* A parameter: a text, or numbers. */
typedef struct {
    const char *text;
    double numbers[2];
} mxArray;
typedef struct {
    mxArray parameters[5];
    int expected, width, contiguous, feed_through, type, rows, columns, sample_times;
    double sample_time, offset, time, input[13];
    void *pointers[2], *output;
    const char *error;
} SimStruct;

int mxGetString(const mxArray *parameter, char *text, size_t size);
#define mxGetPr(parameter) ((parameter)->numbers)
#define mxGetScalar(parameter) ((parameter)->numbers[0])
#define ssGetSFcnParam(S, i) (&(S)->parameters[i])
#define ssSetNumSFcnParams(S, n) ((S)->expected = (n))
#define ssGetNumSFcnParams(S) ((S)->expected)
#define ssGetSFcnParamsCount(S) 5
#define ssSetNumInputPorts(S, n) ((n) == 1)
#define ssSetNumOutputPorts(S, n) ((n) == 1)
#define ssSetInputPortWidth(S, port, n) ((S)->width = (n))
#define ssSetInputPortRequiredContiguous(S, port, value) ((S)->contiguous = (value))
#define ssSetInputPortDirectFeedThrough(S, port, value) ((S)->feed_through = (value))
#define ssSetOutputPortMatrixDimensions(S, port, m, n) ((S)->rows = (m), (S)->columns = (n))
#define ssSetOutputPortDataType(S, port, kind) ((S)->type = (kind))
#define ssSetNumSampleTimes(S, n) ((S)->sample_times = (n))
#define ssSetNumPWork(S, n) ((void)(S), (void)(n))
#define ssSetSampleTime(S, i, value) ((S)->sample_time = (value))
#define ssSetOffsetTime(S, i, value) ((S)->offset = (value))
#define ssSetPWorkValue(S, i, value) ((S)->pointers[i] = (value))
#define ssGetPWorkValue(S, i) ((S)->pointers[i])
#define ssGetOutputPortSignal(S, port) ((S)->output)
#define ssGetInputPortRealSignal(S, port) ((const real_T *)(S)->input)
#define ssGetT(S) ((S)->time)
#define ssSetErrorStatus(S, text) ((S)->error = (text))
#define UNUSED_ARG(value) ((void)(value))

#endif
