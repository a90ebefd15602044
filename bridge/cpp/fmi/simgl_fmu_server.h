/* The server behind an FMU: a running one, or one that the FMU starts for itself. */
#ifndef SIMGL_FMU_SERVER_H
#define SIMGL_FMU_SERVER_H

#include "simgl.h"

#include <sys/types.h>

/* What to connect to, and how to start a server where there is none. */
typedef struct {
    const char *address; /* of a running server; "" always starts one */
    const char *python, *scenario, *scene_hash;
    double timeout_s, ready_timeout_s;
    void (*log)(void *user, const char *line);
    void *user;
} server_request;

/* A server of this FMU; all zero where it has none. */
typedef struct {
    pid_t process;
    char folder[40]; /* holds its socket and what it printed */
} server_process;

/* A client of a server that shows the scene, or NULL with one line in error; description then says
 * which server it is. */
simgl_client *server_connect(const server_request *request, server_process *server,
                             char *description, size_t description_size, char *error,
                             size_t error_size);

/* Whether the FMU's own server has ended, with its last line in error. */
int server_has_ended(server_process *server, char *error, size_t error_size);

/* End the FMU's own server and remove its folder; nothing where it has none. */
void server_end(server_process *server);

#endif
