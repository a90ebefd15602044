#define _XOPEN_SOURCE 700
#include "simgl_fmu_server.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

extern char **environ;

/* simgl serve ends when the process that this names does. */
#define PARENT_VARIABLE "SIMGL_SERVER_PARENT"
/* A server that listens answers well within this, whatever it does. */
#define ATTEMPT_S 2.0
/* A server that lives takes a broken connection up again within a tenth of a second. */
#define RECONNECT_S 3.0
/* A server that was asked to end finishes its image; after this it is killed. */
#define PATIENCE_S 10.0

static double now_s(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static double smaller(double a, double b) { return a < b ? a : b; }

static void path_in(const server_process *server, const char *name, char *path, size_t size) {
    snprintf(path, size, "%s/%s", server->folder, name);
}

static void show_status(const char *state, const char *detail, int64_t done, int64_t total,
                        void *user) {
    const server_request *request = user;
    char line[400];
    if (total > 0)
        snprintf(line, sizeof line, "server is %s: %s %lld of %lld", state, detail,
                 (long long)done, (long long)total);
    else
        snprintf(line, sizeof line, "server is %s%s%s", state, detail[0] ? ": " : "", detail);
    request->log(request->user, line);
}

/* A client with the request's timeout, of a server that answers within a shorter one. */
static simgl_client *connected(const server_request *request, const char *address,
                               double attempt_s, double ready_timeout_s, char *error,
                               size_t error_size) {
    simgl_options options = {.timeout_s = smaller(attempt_s, request->timeout_s),
                             .ready_timeout_s = ready_timeout_s,
                             .reconnect_timeout_s = RECONNECT_S,
                             .retry = 1,
                             .on_status = show_status,
                             .user = (void *)request};
    simgl_client *probe = simgl_connect_with(address, &options, error, error_size);
    if (probe == NULL) return NULL;
    simgl_close(probe);
    options.timeout_s = request->timeout_s;
    options.on_status = NULL;
    return simgl_connect_with(address, &options, error, error_size);
}

/* The environment of this process with another parent variable; NULL without memory. */
static char **server_environment(char *parent) {
    size_t count = 0, used = 0;
    while (environ[count] != NULL) ++count;
    char **all = malloc((count + 2) * sizeof *all);
    if (all == NULL) return NULL;
    for (size_t i = 0; i < count; ++i)
        if (strncmp(environ[i], PARENT_VARIABLE "=", sizeof PARENT_VARIABLE) != 0)
            all[used++] = environ[i];
    all[used++] = parent;
    all[used] = NULL;
    return all;
}

static int spawn(const server_request *request, server_process *server, const char *address) {
    char parent[60], log[60];
    snprintf(parent, sizeof parent, PARENT_VARIABLE "=%ld", (long)getpid());
    path_in(server, "log", log, sizeof log);
    char **variables = server_environment(parent);
    if (variables == NULL) return ENOMEM;
    char *const arguments[] = {(char *)request->python,   "-m",        "simgl",         "serve",
                               (char *)request->scenario, "--address", (char *)address, NULL};
    posix_spawn_file_actions_t files;
    posix_spawnattr_t attributes;
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&files, 1, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addopen(&files, 2, log, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    /* Importers block and ignore signals as they like. Ctrl-C is for them: they free the FMU. */
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF |
                                              POSIX_SPAWN_SETPGROUP);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &all);
    posix_spawnattr_setpgroup(&attributes, 0);
    const int failure =
        posix_spawnp(&server->process, request->python, &files, &attributes, arguments, variables);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&files);
    free(variables);
    if (failure != 0) server->process = 0;
    return failure;
}

/* The last line that the server wrote to stderr. */
static void last_line(const server_process *server, char *line, size_t size) {
    char path[60], text[2048];
    path_in(server, "log", path, sizeof path);
    snprintf(line, size, "it wrote nothing");
    FILE *log = fopen(path, "r");
    if (log == NULL) return;
    while (fgets(text, sizeof text, log) != NULL) {
        text[strcspn(text, "\n")] = '\0';
        if (text[0] != '\0') snprintf(line, size, "%s", text);
    }
    fclose(log);
}

int server_has_ended(server_process *server, char *error, size_t error_size) {
    int status = 0;
    if (server->process == 0 || waitpid(server->process, &status, WNOHANG) == 0) return 0;
    char line[500], how[40] = "";
    last_line(server, line, sizeof line);
    if (WIFSIGNALED(status)) snprintf(how, sizeof how, " by signal %d", WTERMSIG(status));
    snprintf(error, error_size, "the server of this FMU has ended%s: %s", how, line);
    server->process = 0;
    return 1;
}

static simgl_client *start(const server_request *request, server_process *server,
                           const char *address, char *error, size_t error_size) {
    const int failure = spawn(request, server, address);
    if (failure != 0) {
        snprintf(error, error_size, "cannot start \"%s\": %s", request->python, strerror(failure));
        return NULL;
    }
    char line[200];
    snprintf(line, sizeof line, "starting a server at %s, process %ld", address,
             (long)server->process);
    request->log(request->user, line);
    const double deadline = now_s() + request->ready_timeout_s;
    for (;;) {
        const double left = deadline - now_s();
        simgl_client *client =
            left > 0.0 ? connected(request, address, ATTEMPT_S, left, error, error_size) : NULL;
        if (client != NULL || server_has_ended(server, error, error_size)) return client;
        if (left <= 0.0) {
            last_line(server, line, sizeof line);
            snprintf(error, error_size, "%s: not ready within %g s: %s", address,
                     request->ready_timeout_s, line);
            return NULL;
        }
    }
}

simgl_client *server_connect(const server_request *request, server_process *server,
                             char *description, size_t description_size, char *error,
                             size_t error_size) {
    char line[700], address[60];
    if (request->address[0] != '\0') {
        simgl_client *client = connected(request, request->address, 0.5 * ATTEMPT_S,
                                         request->ready_timeout_s, error, error_size);
        if (client != NULL && strcmp(simgl_scene_hash(client), request->scene_hash) == 0) {
            snprintf(description, description_size, "found %s", request->address);
            return client;
        }
        if (client != NULL)
            snprintf(line, sizeof line, "%s serves another scene; it is not used",
                     request->address);
        else
            snprintf(line, sizeof line, "no server: %s", error);
        simgl_close(client);
        request->log(request->user, line);
    }
    if (request->python[0] == '\0' || request->scenario[0] == '\0') {
        snprintf(error, error_size,
                 "no server of this scene at \"%s\", and python or scenario is empty: none can be "
                 "started", request->address);
        return NULL;
    }
    /* A socket in a folder of this user: no port that another program might take. */
    snprintf(server->folder, sizeof server->folder, "/tmp/simgl-fmu-XXXXXX");
    if (mkdtemp(server->folder) == NULL) {
        snprintf(error, error_size, "cannot make a folder in /tmp: %s", strerror(errno));
        server->folder[0] = '\0';
        return NULL;
    }
    snprintf(address, sizeof address, "ipc://%s/socket", server->folder);
    simgl_client *client = start(request, server, address, error, error_size);
    if (client != NULL && strcmp(simgl_scene_hash(client), request->scene_hash) != 0) {
        simgl_close(client);
        client = NULL;
        snprintf(error, error_size,
                 "\"%s\" is not what it was when this FMU was written; write it again with simgl "
                 "fmu", request->scenario);
    }
    if (client == NULL)
        server_end(server);
    else
        snprintf(description, description_size, "started %s", address);
    return client;
}

void server_end(server_process *server) {
    char path[60];
    if (server->process != 0) {
        const struct timespec pause = {0, 20000000};
        const double deadline = now_s() + PATIENCE_S;
        kill(server->process, SIGTERM);
        while (waitpid(server->process, NULL, WNOHANG) == 0) {
            if (now_s() > deadline) kill(server->process, SIGKILL);
            nanosleep(&pause, NULL);
        }
        server->process = 0;
    }
    if (server->folder[0] == '\0') return;
    path_in(server, "log", path, sizeof path);
    unlink(path);
    path_in(server, "socket", path, sizeof path);
    unlink(path);
    rmdir(server->folder);
    server->folder[0] = '\0';
}
