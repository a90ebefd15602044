/* A camera of simgl as a Simulink S-function: pose of one spacecraft in, image out, once a sample.
 *
 *   g++ -std=c++17 -fPIC -c ../simgl.cpp
 *   mex -I.. simgl_sfun.c simgl.o -lzmq -lstdc++
 *
 * Parameters: address, camera, spacecraft, [height width], sample time [s]. Input: position [m],
 * velocity [m/s], quaternion ICRF from body (scalar last), angular velocity [rad/s, body axes].
 * Output: DN as a height x width matrix. Simulink's time 0 is the epoch of the scenario. */
#define S_FUNCTION_NAME simgl_sfun
#define S_FUNCTION_LEVEL 2
#include "simstruc.h"

#include "simgl.h"

#include <math.h>
#include <stdlib.h>

enum { ADDRESS, CAMERA, SPACECRAFT, SIZE, SAMPLE_TIME, PARAMETERS };
static char error[400]; /* Simulink reads it after the call */

static int size_of(SimStruct *S, int axis) { return (int)mxGetPr(ssGetSFcnParam(S, SIZE))[axis]; }

static void mdlInitializeSizes(SimStruct *S) {
    ssSetNumSFcnParams(S, PARAMETERS);
    if (ssGetNumSFcnParams(S) != ssGetSFcnParamsCount(S) || !ssSetNumInputPorts(S, 1) ||
        !ssSetNumOutputPorts(S, 1)) return;
    ssSetInputPortWidth(S, 0, 13);
    ssSetInputPortRequiredContiguous(S, 0, 1);
    ssSetInputPortDirectFeedThrough(S, 0, 1);
    ssSetOutputPortMatrixDimensions(S, 0, size_of(S, 0), size_of(S, 1));
    ssSetOutputPortDataType(S, 0, SS_UINT16);
    ssSetNumSampleTimes(S, 1);
    ssSetNumPWork(S, 1);
}

static void mdlInitializeSampleTimes(SimStruct *S) {
    ssSetSampleTime(S, 0, mxGetScalar(ssGetSFcnParam(S, SAMPLE_TIME)));
    ssSetOffsetTime(S, 0, 0.0);
}

#define MDL_START
static void mdlStart(SimStruct *S) {
    const simgl_options options = {.timeout_s = 60.0, .reconnect_timeout_s = 3.0, .retry = 1};
    char address[200];
    mxGetString(ssGetSFcnParam(S, ADDRESS), address, sizeof address);
    ssSetPWorkValue(S, 0, simgl_connect_with(address, &options, error, sizeof error));
    if (ssGetPWorkValue(S, 0) == NULL) ssSetErrorStatus(S, error);
}

static void mdlOutputs(SimStruct *S, int_T tid) {
    char camera[101], name[101];
    simgl_client *client = ssGetPWorkValue(S, 0);
    const real_T *p = ssGetInputPortRealSignal(S, 0);
    const simgl_body body = {.name = name,
                             .position_m = {p[0], p[1], p[2]},
                             .velocity_m_s = {p[3], p[4], p[5]},
                             .q_icrf_from_body_xyzw = {p[6], p[7], p[8], p[9]},
                             .angular_velocity_rad_s = {p[10], p[11], p[12]}};
    const int64_t tai_ns = simgl_epoch_tai_ns(client) + llround(1e9 * ssGetT(S));
    const int height = size_of(S, 0), width = size_of(S, 1), pixels = height * width;
    int32_t columns = 0, lines = 0;
    uint16_t *rows = calloc(pixels, sizeof *rows), *image = ssGetOutputPortSignal(S, 0);
    UNUSED_ARG(tid);
    mxGetString(ssGetSFcnParam(S, CAMERA), camera, sizeof camera);
    mxGetString(ssGetSFcnParam(S, SPACECRAFT), name, sizeof name);
    if (!simgl_camera_size(client, camera, &columns, &lines) && (columns != width || lines != height))
        ssSetErrorStatus(S, "[height width] is not the size of the camera");
    else if (simgl_render_dn(client, tai_ns, camera, &body, 1, 0.0, rows, pixels, NULL, error, sizeof error))
        ssSetErrorStatus(S, error);
    else /* Simulink's matrices lie column by column. */
        for (int i = 0; i < pixels; ++i) image[i] = rows[i % height * width + i / height];
    free(rows);
}

static void mdlTerminate(SimStruct *S) { simgl_close(ssGetPWorkValue(S, 0)); }

#ifdef MATLAB_MEX_FILE
#include "simulink.c"
#else
#include "cg_sfun.h"
#endif
