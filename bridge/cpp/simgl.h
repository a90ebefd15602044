/* A client of simgl's image service for C: Simulink S-functions, flight-software stubs.
 *
 * Compile simgl.cpp with a C++17 compiler and link with libzmq; this header is plain C99.
 * Every call ends after the client's timeout. Functions return SIMGL_OK, or a code and an
 * error message of one line. Units are in the names; see simgl.hpp. */
#ifndef SIMGL_H
#define SIMGL_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
    SIMGL_OK = 0,
    SIMGL_REFUSED = 1,   /* the server refused the request */
    SIMGL_NO_ANSWER = 2, /* server not running or blocked; the next call connects again */
    SIMGL_BAD_REPLY = 3, /* the reply does not show what was asked for */
    SIMGL_BAD_ARGUMENT = 4 /* a null pointer, a repeated name, a small buffer; nothing was sent */
};

typedef struct simgl_client simgl_client;

/* A named number: a joint's angle [rad] or travel [m], a lamp's share of its power. */
typedef struct {
    const char *name;
    double value;
} simgl_setting;

/* Members left out of an initialiser are zero, which leaves them out of the request; an attitude is
 * always needed: four zeros are refused. */
typedef struct {
    const char *name;
    double position_m[3];
    double velocity_m_s[3];
    double q_icrf_from_body_xyzw[4];
    double angular_velocity_rad_s[3]; /* relative to ICRF, in body axes; used with moving */
    const simgl_setting *joints;
    size_t joint_count;
} simgl_body;

/* Optional parts of a request; all zero leaves them out. */
typedef struct {
    const simgl_setting *lamps; /* shares 0 to 1; lamps left out burn fully */
    size_t lamp_count;
    int moving; /* bodies move with their rates while the shutter is open: motion blur */
    int seek;   /* allow a time before that of the last request */
    const double *sun_position_m; /* 3 numbers; NULL leaves the Sun to the scenario */
    double gain_dn_per_e;         /* 0 takes the camera's own; with several cameras each has its own */
    uint32_t draw;                /* of several images of one time: another has other noise */
} simgl_scene;

typedef struct {
    uint64_t sequence;
    int64_t tai_ns; /* mid-exposure */
    int64_t exposure_start_tai_ns, exposure_end_tai_ns, readout_end_tai_ns;
    int64_t available_tai_ns; /* when flight software receives the image */
    int32_t width, height;
    double exposure_time_s, gain_dn_per_e;
    double camera_position_m[3];
    double q_camera_from_icrf_xyzw[4];
    double intrinsics[9]; /* row by row */
    int64_t saturated_pixels;
    char state_hash[33];
} simgl_image;

/* A camera of a request, and where its image goes: pixels holds pixel_count numbers, at least as
 * many as the camera has; info may be NULL. */
typedef struct {
    const char *camera;
    double exposure_time_s, gain_dn_per_e; /* 0 takes the camera's own */
    uint16_t *pixels;
    size_t pixel_count;
    simgl_image *info;
} simgl_shot;

/* Told while a server is starting; see Status in simgl.hpp. */
typedef void (*simgl_on_status)(const char *state, const char *detail, int64_t done, int64_t total,
                                void *user);

/* Keys for a server that needs them, in ZeroMQ's Z85 form: 40 characters, as they stand behind
 * public-key and secret-key in the files that simgl keys makes. */
typedef struct {
    const char *server; /* the server's public key */
    const char *public_key, *secret_key; /* of this client */
} simgl_keys;

/* Of a connection; all zero takes the values in brackets. */
typedef struct {
    double timeout_s;       /* of every call [10] */
    double ready_timeout_s; /* for a server that is starting [600] */
    /* A connection that broke must be back within this of a request [timeout_s]. */
    double reconnect_timeout_s;
    int retry; /* send a request once more where the server lost its renderer over it */
    const simgl_keys *keys;
    simgl_on_status on_status; /* called while the server is starting, with user */
    void *user;
} simgl_options;

/* Returns a client, or NULL with the reason in error. */
simgl_client *simgl_connect(const char *address, double timeout_s, char *error, size_t error_size);

/* The same with keys and the other options; NULL takes what is in brackets above. */
simgl_client *simgl_connect_with(const char *address, const simgl_options *options, char *error,
                                 size_t error_size);
/* NULL is allowed. */
void simgl_close(simgl_client *client);

/* Start of the server's scenario; 0 for a client that is NULL. */
int64_t simgl_epoch_tai_ns(const simgl_client *client);
/* Hash of everything that the server's scenario holds except its seed; "" for a client that is NULL. */
const char *simgl_scene_hash(const simgl_client *client);
/* Hash of an image's content, as records of sessions have it: BLAKE2b with 16 bytes over the
 * little-endian pixels, in hexadecimal digits. */
void simgl_plane_hash(const uint16_t *pixels, size_t pixel_count, char hash[33]);
/* Width and height of a camera in pixels. */
int simgl_camera_size(const simgl_client *client, const char *camera, int32_t *width,
                      int32_t *height);

/* The DN that a camera takes of a state, row by row from the top. An exposure of 0
 * takes the camera's own. pixels holds pixel_count numbers, at least as many as the camera has; info may
 * be NULL. */
int simgl_render_dn(simgl_client *client, int64_t tai_ns, const char *camera,
                    const simgl_body *bodies, size_t body_count, double exposure_time_s,
                    uint16_t *pixels, size_t pixel_count, simgl_image *info, char *error,
                    size_t error_size);

/* The same with lamps, motion blur or another Sun; scene may be NULL. */
int simgl_render_scene_dn(simgl_client *client, int64_t tai_ns, const char *camera,
                          const simgl_body *bodies, size_t body_count, const simgl_scene *scene,
                          double exposure_time_s, uint16_t *pixels, size_t pixel_count,
                          simgl_image *info, char *error, size_t error_size);

/* The DN that several cameras take of one state, in one request. After an error no pixels are to be
 * used. */
int simgl_render_cameras_dn(simgl_client *client, int64_t tai_ns, const simgl_shot *shots,
                            size_t shot_count, const simgl_body *bodies, size_t body_count,
                            const simgl_scene *scene, char *error, size_t error_size);

#ifdef __cplusplus
}
#endif
#endif
