/* A glTF document's beginning with one triangle, for tests of what stands around meshes. */
#ifndef TESTS_TRIANGLE_TEXT_H
#define TESTS_TRIANGLE_TEXT_H

#include "check.h"

#include <cranny/scene.h>

/* Accessor 0: the corners (0,0,0) (1,0,0) (0,1,0), accessor 1: their indices; ' stands for ". */
#define TRIANGLE                                                                                   \
    "{'asset':{'version':'2.0'},'buffers':[{'byteLength':44,'uri':'data:application/octet-stream;" \
    "base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIAAAA='}],"                      \
    "'bufferViews':[{'buffer':0,'byteLength':36},{'buffer':0,'byteOffset':36,'byteLength':6}],"    \
    "'accessors':[{'bufferView':0,'componentType':5126,'count':3,'type':'VEC3','min':[0,0,0],"     \
    "'max':[1,1,0]},{'bufferView':1,'componentType':5123,'count':3,'type':'SCALAR'}],"
#define PRIMITIVES "'primitives':[{'attributes':{'POSITION':0},'indices':1}]"

struct log {
    int lines;
    char first[512], last[512];
};

static inline void keep_line(void *user, enum cranny_log_level level, const char *line)
{
    struct log *log = user;
    if (level != CRANNY_LOG_WARNING)
        return;
    if (!log->lines++)
        snprintf(log->first, sizeof log->first, "%s", line);
    snprintf(log->last, sizeof log->last, "%s", line);
}

/* Load TRIANGLE with `rest` behind it; NULL is a failed check. */
static inline struct cranny_scene *load_quoted(const char *rest, struct log *log)
{
    struct cranny_scene_load_params params = cranny_scene_load_params_default();
    struct cranny_hooks hooks = {.user = log, .log = keep_line};
    struct cranny_scene *scene = NULL;
    struct cranny_error why;
    params.hooks = &hooks;
    *log = (struct log){0};
    char *text = malloc(strlen(TRIANGLE) + strlen(rest) + 1);
    sprintf(text, "%s%s", TRIANGLE, rest);
    for (char *c = text; *c; c++)
        *c = *c == '\'' ? '"' : *c;
    CHECK_OK(cranny_scene_load_memory(text, strlen(text), "test.gltf", &params, &scene, &why), why);
    free(text);
    return scene;
}

#endif
