/* Scenes and the ways to look at them, as commands take them that look at several: each scene may
 * have views and a radius of its own on the command line. */
#ifndef CLI_VIEWS_H
#define CLI_VIEWS_H

#include "render.h"

enum { SCENE_LIMIT = 64, VIEW_LIMIT = 999 };

/* --view, --radius, --views. */
struct views_options {
    struct option_list views, radii;
    int count; /* of --views; 0: not given */
};
extern const struct option_group views_options;

/* A loaded scene, and what the command line says of it. */
struct views_task {
    const struct interface *face;
    const struct views_options *options;
    const struct scene_options *scene_options;
    const struct view_options *lens;
    const struct cranny_scene *scene;
    const struct cranny_tracer *tracer;
    size_t number; /* of the operand that it was read from, from 0 */
};

/* One way to look at it. */
struct sight {
    char *camera;  /* what to call it; owned */
    char *options; /* of the command, that look at it; owned, "" for none */
    struct cranny_camera eye;
    double radius_world;
    int guard;
};
void sight_free(struct sight *sight);

/* Make room for one more of `size` bytes after `count` of them; false when there are VIEW_LIMIT, or
 * no memory. */
bool views_grow(void **views, size_t count, size_t *room, size_t size);

/* Take a sight over, also when it fails. */
typedef enum cranny_status views_take(void *user, struct sight sight, struct cranny_error *why);

/* What does not fit together, as far as no scene is needed. */
enum cranny_status views_check(const struct views_task *task, struct cranny_error *why);

/* The scene's views, one after the other. */
enum cranny_status views_find(const struct views_task *task, views_take *take, void *user,
                              struct cranny_error *why);

/* The same sight turned by a share of a whole turn: around the scene when it is seen from outside,
 * else around the eye. `options` stays empty. */
enum cranny_status views_turn(const struct views_task *task, const struct sight *sight,
                              double share, struct sight *turned, struct cranny_error *why);

/* Load a scene to look at, and make its tracer. */
enum cranny_status views_load(struct ui *ui, const char *path, const struct load_options *options,
                              int threads, struct cranny_scene **scene,
                              struct cranny_tracer **tracer, struct cranny_error *why);

/* Draw what a sight shows. */
enum cranny_status views_draw(const struct views_task *task, const struct sight *sight, int threads,
                              const struct cranny_hooks *hooks, struct cranny_frame **frame,
                              struct cranny_error *why);

/* A path's last part. */
const char *views_name(const char *path);

#endif
