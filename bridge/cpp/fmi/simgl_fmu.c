/* A camera of simgl as an FMU (FMI 3.0, co-simulation), over the C client.
 *
 * A step takes one image: of the inputs as they are at its start, with mid-exposure at
 * epoch_tai_ns + current communication point + exposure_offset_s. Time belongs to the importer. A
 * step that gets no image returns fmi3Error with the reason, and the image is then gone: no
 * importer takes an old one for a new one. */
#define _XOPEN_SOURCE 700
#include "fmi3Functions.h"
#include "simgl.h"
#include "simgl_fmu_server.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Where the values of a type are stored. */
typedef enum { REAL, INTEGER, FLAG, TEXT, IMAGE, IMAGE_BYTES } fmu_store;
typedef enum { INDEPENDENT, PARAMETER, INPUT, OUTPUT } fmu_causality;
typedef struct {
    fmu_store store;
    fmu_causality causality;
    size_t size, offset;
    const char *name;
} fmu_variable;
/* Thirteen numbers from an offset on: position, velocity, quaternion, angular velocity. */
typedef struct {
    const char *name;
    size_t offset, first_joint, joint_count;
} fmu_body;
/* A joint or a lamp. */
typedef struct {
    const char *name;
    size_t offset;
} fmu_setting;

#include "simgl_fmu_model.h"

#define VARIABLE_COUNT (sizeof VARIABLES / sizeof VARIABLES[0])
#define PIXEL_COUNT ((size_t)MODEL_WIDTH * MODEL_HEIGHT)

typedef enum { INSTANTIATED, INITIALIZATION, STEPPING, FAILED, TERMINATED } fmu_mode;
/* Values of status; see IMAGE_STATES in variables.py. */
enum { NO_IMAGE, NEW_IMAGE, HELD_IMAGE };

typedef struct {
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
    bool logs_server;
    fmu_mode mode;
    double reals[REAL_COUNT];
    fmi3Int64 integers[INTEGER_COUNT];
    fmi3Boolean flags[FLAG_COUNT];
    char *texts[TEXT_COUNT];
    uint16_t *image;
    simgl_client *client;
    server_process server;
} fmu_instance;

static fmi3Status fail(fmu_instance *fmu, const char *format, ...) {
    char line[1200];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    if (fmu->log != NULL) fmu->log(fmu->environment, fmi3Error, "logStatusError", line);
    return fmi3Error;
}

static void log_server(void *instance, const char *line) {
    const fmu_instance *fmu = instance;
    if (fmu->logs_server && fmu->log != NULL) fmu->log(fmu->environment, fmi3OK, "server", line);
}

/* Whether there was memory for a copy of the text. */
static bool set_text(fmu_instance *fmu, size_t at, const char *text) {
    char *copy = malloc(strlen(text) + 1);
    if (copy == NULL) return false;
    free(fmu->texts[at]);
    fmu->texts[at] = strcpy(copy, text);
    return true;
}

/* Every output as before the first image. */
static bool clear_outputs(fmu_instance *fmu) {
    bool enough = true;
    memset(fmu->image, 0, PIXEL_COUNT * sizeof *fmu->image);
    for (size_t i = 0; i < VARIABLE_COUNT; ++i) {
        const fmu_variable *v = &VARIABLES[i];
        if (v->causality != OUTPUT) continue;
        for (size_t at = v->offset; at < v->offset + v->size; ++at) {
            if (v->store == REAL) fmu->reals[at] = 0.0;
            if (v->store == INTEGER) fmu->integers[at] = 0;
            if (v->store == TEXT) enough = set_text(fmu, at, "") && enough;
        }
    }
    return enough;
}

static bool set_starts(fmu_instance *fmu) {
    bool enough = true;
    memcpy(fmu->reals, REAL_STARTS, sizeof fmu->reals);
    memcpy(fmu->integers, INTEGER_STARTS, sizeof fmu->integers);
    memcpy(fmu->flags, FLAG_STARTS, sizeof fmu->flags);
    for (size_t i = 0; i < TEXT_COUNT; ++i) enough = set_text(fmu, i, TEXT_STARTS[i]) && enough;
    fmu->mode = INSTANTIATED;
    return clear_outputs(fmu) && enough;
}

static void disconnect(fmu_instance *fmu) {
    simgl_close(fmu->client);
    fmu->client = NULL;
    server_end(&fmu->server);
}

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[]) {
    fmu_instance *fmu = instance;
    bool wanted = nCategories == 0;
    for (size_t i = 0; i < nCategories; ++i)
        if (strcmp(categories[i], "server") == 0) wanted = true;
    if (wanted) fmu->logs_server = loggingOn;
    return fmi3OK;
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
    fmi3Boolean earlyReturnAllowed, const fmi3ValueReference requiredIntermediateVariables[],
    size_t nRequiredIntermediateVariables, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3IntermediateUpdateCallback intermediateUpdate) {
    (void)instanceName, (void)resourcePath, (void)visible, (void)eventModeUsed;
    (void)earlyReturnAllowed, (void)requiredIntermediateVariables;
    (void)nRequiredIntermediateVariables, (void)intermediateUpdate;
    fmu_instance *fmu = calloc(1, sizeof *fmu);
    if (fmu == NULL) return NULL;
    fmu->environment = instanceEnvironment;
    fmu->log = logMessage;
    fmu->logs_server = loggingOn;
    fmu->image = malloc(PIXEL_COUNT * sizeof *fmu->image);
    if (strcmp(instantiationToken, MODEL_TOKEN) != 0)
        fail(fmu, "the model description is of another FMU: its instantiationToken is \"%s\"",
             instantiationToken);
    else if (fmu->image != NULL && set_starts(fmu))
        return fmu;
    fmi3FreeInstance(fmu);
    return NULL;
}

void fmi3FreeInstance(fmi3Instance instance) {
    fmu_instance *fmu = instance;
    if (fmu == NULL) return;
    disconnect(fmu);
    for (size_t i = 0; i < TEXT_COUNT; ++i) free(fmu->texts[i]);
    free(fmu->image);
    free(fmu);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined,
                                       fmi3Float64 tolerance, fmi3Float64 startTime,
                                       fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {
    (void)toleranceDefined, (void)tolerance, (void)stopTimeDefined, (void)stopTime;
    fmu_instance *fmu = instance;
    if (fmu->mode != INSTANTIATED) return fail(fmu, "initialized twice without a reset");
    fmu->reals[AT_time] = startTime;
    fmu->mode = INITIALIZATION;
    return fmi3OK;
}

/* Parameters are known now: find or start the server. */
fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    fmu_instance *fmu = instance;
    char error[1000], description[300];
    if (fmu->mode != INITIALIZATION) return fail(fmu, "not in initialization mode");
    const server_request request = {
        fmu->texts[AT_server_address], fmu->texts[AT_python],
        fmu->texts[AT_scenario],       MODEL_SCENE_HASH,
        fmu->reals[AT_timeout_s],      fmu->reals[AT_ready_timeout_s],
        log_server,                    fmu,
    };
    fmu->client = server_connect(&request, &fmu->server, description, sizeof description, error,
                                 sizeof error);
    if (fmu->client == NULL) {
        fmu->mode = FAILED;
        return fail(fmu, "%s", error);
    }
    fmu->mode = STEPPING;
    log_server(fmu, description);
    if (!set_text(fmu, AT_server, description)) return fail(fmu, "out of memory");
    return fmi3OK;
}

fmi3Status fmi3Terminate(fmi3Instance instance) {
    fmu_instance *fmu = instance;
    disconnect(fmu);
    fmu->mode = TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance) {
    fmu_instance *fmu = instance;
    disconnect(fmu);
    return set_starts(fmu) ? fmi3OK : fail(fmu, "out of memory");
}

/* The variable of a reference, or NULL with a message. */
static const fmu_variable *variable(fmu_instance *fmu, fmi3ValueReference reference,
                                    fmu_store store, bool to_set) {
    if (reference >= VARIABLE_COUNT || VARIABLES[reference].store != store) {
        fail(fmu, "no variable of this type has the value reference %u", (unsigned)reference);
        return NULL;
    }
    const fmu_variable *v = &VARIABLES[reference];
    if (!to_set && v->causality == OUTPUT && fmu->mode == FAILED) {
        fail(fmu, "%s: the step failed, there is no image", v->name);
        return NULL;
    }
    const bool starting = fmu->mode == INSTANTIATED || fmu->mode == INITIALIZATION;
    const bool settable = v->causality == INPUT ? starting || fmu->mode == STEPPING
                                                : v->causality == PARAMETER && starting;
    if (to_set && !settable) {
        fail(fmu, "%s: cannot be set now", v->name);
        return NULL;
    }
    return v;
}

/* Copy between a store, of elements of a size, and the values of a call. */
static fmi3Status transfer(fmu_instance *fmu, fmu_store store, void *stored, size_t element,
                           const fmi3ValueReference references[], size_t reference_count,
                           void *read, const void *written, size_t value_count) {
    size_t at = 0;
    for (size_t i = 0; i < reference_count; ++i) {
        const fmu_variable *v = variable(fmu, references[i], store, written != NULL);
        if (v == NULL) return fmi3Error;
        if (v->size > value_count - at) return fail(fmu, "%s: too few values", v->name);
        char *place = (char *)stored + v->offset * element;
        if (written != NULL)
            memcpy(place, (const char *)written + at * element, v->size * element);
        else
            memcpy((char *)read + at * element, place, v->size * element);
        at += v->size;
    }
    return at == value_count ? fmi3OK : fail(fmu, "too many values");
}

#define GETTER(NAME, STORE, STORED)                                                               \
    fmi3Status fmi3Get##NAME(fmi3Instance instance, const fmi3ValueReference valueReferences[],   \
                             size_t nValueReferences, fmi3##NAME values[], size_t nValues) {      \
        fmu_instance *fmu = instance;                                                             \
        return transfer(fmu, STORE, fmu->STORED, sizeof values[0], valueReferences,               \
                        nValueReferences, values, NULL, nValues);                                 \
    }
#define SETTER(NAME, STORE, STORED)                                                               \
    fmi3Status fmi3Set##NAME(fmi3Instance instance, const fmi3ValueReference valueReferences[],   \
                             size_t nValueReferences, const fmi3##NAME values[],                  \
                             size_t nValues) {                                                    \
        fmu_instance *fmu = instance;                                                             \
        return transfer(fmu, STORE, fmu->STORED, sizeof values[0], valueReferences,               \
                        nValueReferences, NULL, values, nValues);                                 \
    }

GETTER(Float64, REAL, reals)
SETTER(Float64, REAL, reals)
GETTER(Int64, INTEGER, integers)
SETTER(Int64, INTEGER, integers)
GETTER(Boolean, FLAG, flags)
SETTER(Boolean, FLAG, flags)
GETTER(String, TEXT, texts)
GETTER(UInt16, IMAGE, image)

fmi3Status fmi3SetString(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                         size_t nValueReferences, const fmi3String values[], size_t nValues) {
    fmu_instance *fmu = instance;
    if (nValues != nValueReferences) return fail(fmu, "a text for each value reference");
    for (size_t i = 0; i < nValueReferences; ++i) {
        const fmu_variable *v = variable(fmu, valueReferences[i], TEXT, true);
        if (v == NULL) return fmi3Error;
        if (!set_text(fmu, v->offset, values[i])) return fail(fmu, "out of memory");
    }
    return fmi3OK;
}

/* The pixels as they lie in memory: little-endian on every machine that FMUs are loaded on. */
fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                         size_t nValueReferences, size_t valueSizes[], fmi3Binary values[],
                         size_t nValues) {
    fmu_instance *fmu = instance;
    if (nValues != nValueReferences) return fail(fmu, "a value for each value reference");
    for (size_t i = 0; i < nValueReferences; ++i) {
        if (variable(fmu, valueReferences[i], IMAGE_BYTES, false) == NULL) return fmi3Error;
        valueSizes[i] = PIXEL_COUNT * sizeof *fmu->image;
        values[i] = (fmi3Binary)fmu->image;
    }
    return fmi3OK;
}

static void copy_settings(const fmu_instance *fmu, const fmu_setting *settings, size_t count,
                          simgl_setting *sent) {
    for (size_t i = 0; i < count; ++i)
        sent[i] = (simgl_setting){settings[i].name, fmu->reals[settings[i].offset]};
}

static void copy_bodies(const fmu_instance *fmu, size_t count, const simgl_setting *joints,
                        simgl_body *bodies) {
    for (size_t i = 0; i < count; ++i) {
        const double *pose = fmu->reals + BODIES[i].offset;
        simgl_body *sent = &bodies[i];
        sent->name = BODIES[i].name;
        memcpy(sent->position_m, pose, sizeof sent->position_m);
        memcpy(sent->velocity_m_s, pose + 3, sizeof sent->velocity_m_s);
        memcpy(sent->q_icrf_from_body_xyzw, pose + 6, sizeof sent->q_icrf_from_body_xyzw);
        memcpy(sent->angular_velocity_rad_s, pose + 10, sizeof sent->angular_velocity_rad_s);
        sent->joints = joints + BODIES[i].first_joint;
        sent->joint_count = BODIES[i].joint_count;
    }
}

/* SIMGL_OK, or another code with one line in error. */
static int render(fmu_instance *fmu, int64_t tai_ns, simgl_image *image, char *error,
                  size_t error_size) {
    simgl_body bodies[BODY_COUNT + 1];
    simgl_setting joints[JOINT_COUNT + 1], lamps[LAMP_COUNT + 1];
    simgl_scene scene = {0};
    copy_settings(fmu, JOINTS, JOINT_COUNT, joints);
    copy_settings(fmu, LAMPS, LAMP_COUNT, lamps);
    copy_bodies(fmu, BODY_COUNT, joints, bodies);
    scene.lamps = lamps;
    scene.lamp_count = LAMP_COUNT;
    scene.moving = fmu->flags[AT_motion_blur];
    scene.gain_dn_per_e = fmu->reals[AT_gain_dn_per_e];
    scene.draw = (uint32_t)fmu->integers[AT_draw];
    if (MODEL_SENDS_SUN) scene.sun_position_m = fmu->reals + AT_sun_position_icrf_m;
    return simgl_render_scene_dn(fmu->client, tai_ns, MODEL_CAMERA, bodies, BODY_COUNT, &scene,
                                 fmu->reals[AT_exposure_time_s], fmu->image, PIXEL_COUNT, image,
                                 error, error_size);
}

static bool show_image(fmu_instance *fmu, const simgl_image *image) {
    char hash[33];
    const int64_t epoch = fmu->integers[AT_epoch_tai_ns];
    simgl_plane_hash(fmu->image, PIXEL_COUNT, hash);
    fmu->integers[AT_status] = NEW_IMAGE;
    fmu->integers[AT_frame_number] += 1;
    fmu->integers[AT_mid_exposure_tai_ns] = image->tai_ns;
    fmu->reals[AT_mid_exposure_s] = 1e-9 * (double)(image->tai_ns - epoch);
    fmu->reals[AT_available_s] = 1e-9 * (double)(image->available_tai_ns - epoch);
    fmu->reals[AT_saturated_share] = (double)image->saturated_pixels / (double)PIXEL_COUNT;
    memcpy(fmu->reals + AT_camera_position_icrf_m, image->camera_position_m,
           sizeof image->camera_position_m);
    memcpy(fmu->reals + AT_camera_q_camera_from_icrf_xyzw, image->q_camera_from_icrf_xyzw,
           sizeof image->q_camera_from_icrf_xyzw);
    memcpy(fmu->reals + AT_camera_intrinsics, image->intrinsics, sizeof image->intrinsics);
    return set_text(fmu, AT_frame_hash, hash) && set_text(fmu, AT_state_hash, image->state_hash);
}

/* Whether the step took its image; else there is no image any more, and error says why. */
static bool take_image(fmu_instance *fmu, double time_s, char *error, size_t error_size) {
    simgl_image image = {0};
    const double mid_exposure_s = time_s + fmu->reals[AT_exposure_offset_s];
    if (server_has_ended(&fmu->server, error, error_size)) return false;
    if (!(fabs(mid_exposure_s) < 4e9)) {
        snprintf(error, error_size, "no image at the time %g s", mid_exposure_s);
        return false;
    }
    if (fmu->integers[AT_draw] < 0 || fmu->integers[AT_draw] > UINT32_MAX) {
        snprintf(error, error_size, "draw must lie in 0..4294967295, got %lld",
                 (long long)fmu->integers[AT_draw]);
        return false;
    }
    const int64_t tai_ns = fmu->integers[AT_epoch_tai_ns] + llround(1e9 * mid_exposure_s);
    if (render(fmu, tai_ns, &image, error, error_size) != SIMGL_OK) return false;
    if (show_image(fmu, &image)) return true;
    snprintf(error, error_size, "out of memory");
    return false;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint,
                      fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                      fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation,
                      fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime) {
    (void)noSetFMUStatePriorToCurrentPoint;
    fmu_instance *fmu = instance;
    char error[1000];
    *eventHandlingNeeded = *terminateSimulation = *earlyReturn = fmi3False;
    *lastSuccessfulTime = currentCommunicationPoint;
    if (fmu->mode != STEPPING)
        return fail(fmu, "no step is possible %s",
                    fmu->mode == FAILED ? "after an error, only a reset" : "in this mode");
    if (!(communicationStepSize > 0.0))
        return fail(fmu, "a step must last longer than %g s", communicationStepSize);
    if (!fmu->flags[AT_trigger]) {
        if (fmu->integers[AT_frame_number] > 0) fmu->integers[AT_status] = HELD_IMAGE;
    } else if (!take_image(fmu, currentCommunicationPoint, error, sizeof error)) {
        clear_outputs(fmu);
        fmu->mode = FAILED;
        return fail(fmu, "%s", error);
    }
    fmu->reals[AT_time] = currentCommunicationPoint + communicationStepSize;
    *lastSuccessfulTime = fmu->reals[AT_time];
    return fmi3OK;
}
