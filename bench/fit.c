/* Which constants bring a method nearest to the truth: every combination of the values given, on
 * all views of bench/views.c, split in those that choose (--train: the first of each scene, the
 * default) and those that judge (--held).
 *
 * Usage: bench-fit --method M [--size WxH] [--rays N] [--cache FOLDER] [--all|--train|--held]
 *                  [--scene NAME] [--set NAME=VALUE]... NAME=V1,V2,... ... */
#include "views.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { AXES = 8, VALUES = 16, COMBINATIONS = 1024 };

struct axis {
    const char *name, *values[VALUES];
    int count;
};

struct fit {
    enum cranny_method method;
    int width, height, rays, which; /* 0 train, 1 held, 2 all */
    const char *cache, *scene;
    struct axis axes[AXES];
    int axis_count, combinations;
    double errors[COMBINATIONS], rmse[COMBINATIONS], bias[COMBINATIONS];
    int seen;
};

static bool parse_axis(struct fit *fit, char *text)
{
    char *equals = strchr(text, '=');
    if (!equals || fit->axis_count == AXES)
        return false;
    struct axis *axis = &fit->axes[fit->axis_count++];
    *equals = 0;
    axis->name = text;
    for (char *value = strtok(equals + 1, ","); value && axis->count < VALUES;
         value = strtok(NULL, ","))
        axis->values[axis->count++] = value;
    return axis->count > 0;
}

static bool parse(int argc, char **argv, struct fit *fit)
{
    bool method = false;
    *fit = (struct fit){.width = 640, .height = 360, .rays = 1024};
    for (int i = 1; i < argc; i++) {
        const char *name = argv[i], *value = i + 1 < argc ? argv[i + 1] : NULL;
        if (strcmp(name, "--train") == 0 || strcmp(name, "--held") == 0 ||
            strcmp(name, "--all") == 0)
            fit->which = name[2] == 't' ? 0 : name[2] == 'h' ? 1 : 2;
        else if (name[0] != '-') {
            if (!parse_axis(fit, argv[i]))
                return false;
        } else if (!value)
            return false;
        else if (strcmp(name, "--method") == 0)
            method = cranny_method_find(argv[++i], &fit->method);
        else if (strcmp(name, "--cache") == 0)
            fit->cache = argv[++i];
        else if (strcmp(name, "--scene") == 0)
            fit->scene = argv[++i];
        else if (strcmp(name, "--rays") == 0)
            fit->rays = atoi(argv[++i]);
        else if (strcmp(name, "--size") != 0 ||
                 sscanf(argv[++i], "%dx%d", &fit->width, &fit->height) != 2)
            return false;
    }
    fit->combinations = 1;
    for (int a = 0; a < fit->axis_count; a++)
        fit->combinations *= fit->axes[a].count;
    return method && fit->combinations <= COMBINATIONS;
}

static enum cranny_status apply(const struct fit *fit, int combination,
                                struct cranny_screen_params *params, struct cranny_error *why)
{
    enum cranny_status status = CRANNY_OK;
    for (int a = 0; a < fit->axis_count && status == CRANNY_OK; a++) {
        const struct axis *axis = &fit->axes[a];
        status = cranny_params_set(cranny_screen_param_table(fit->method), params, axis->name,
                                   axis->values[combination % axis->count], why);
        combination /= axis->count;
    }
    return status;
}

static enum cranny_status run_view(struct fit *fit, struct view_stage *stage,
                                   const struct view *view, struct cranny_workspace *workspace,
                                   struct cranny_error *why)
{
    struct view_sight sight;
    float *picture = malloc((size_t)fit->width * (size_t)fit->height * sizeof *picture);
    enum cranny_status status =
        view_see(stage, view, fit->width, fit->height, fit->rays, fit->cache, &sight, why);
    for (int c = 0; c < fit->combinations && status == CRANNY_OK && picture; c++) {
        struct cranny_screen_params params = cranny_screen_params_preset(fit->method, NULL);
        struct cranny_difference d = {0};
        params.radius_world = view->radius_world;
        params.workspace = workspace;
        status = apply(fit, c, &params, why);
        if (status == CRANNY_OK)
            status = cranny_screen_render(&sight.gbuffer, &params, picture, 0, why);
        if (status == CRANNY_OK)
            status = cranny_difference_measure(fit->width, fit->height, picture, 0, sight.truth, 0,
                                               &d, why);
        fit->errors[c] += d.error;
        fit->rmse[c] += d.rmse;
        fit->bias[c] += d.mean;
    }
    fit->seen++;
    view_sight_free(&sight);
    free(picture);
    return status;
}

static void print(const struct fit *fit)
{
    for (int c = 0; c < fit->combinations; c++) {
        int rest = c;
        printf("%8.4f  rmse %.4f  bias %+.4f ", fit->errors[c] / fit->seen,
               fit->rmse[c] / fit->seen, fit->bias[c] / fit->seen);
        for (int a = 0; a < fit->axis_count; a++) {
            printf(" %s=%s", fit->axes[a].name, fit->axes[a].values[rest % fit->axes[a].count]);
            rest /= fit->axes[a].count;
        }
        printf("\n");
    }
}

static enum cranny_status run_all(struct fit *fit, struct cranny_error *why)
{
    struct view_stage stage = {0};
    struct cranny_workspace *workspace;
    enum cranny_status status = cranny_workspace_create(&workspace, why);
    for (int v = 0; v < view_count && status == CRANNY_OK; v++) {
        const bool first = v == 0 || strcmp(views[v - 1].scene, views[v].scene) != 0;
        char *path = view_path(&views[v]);
        if (path && (!fit->scene || strcmp(fit->scene, views[v].scene) == 0) &&
            (fit->which == 2 || (fit->which == 0) == first))
            status = run_view(fit, &stage, &views[v], workspace, why);
        free(path);
    }
    view_leave(&stage);
    cranny_workspace_destroy(&workspace);
    return status;
}

int main(int argc, char **argv)
{
    static struct fit fit;
    struct cranny_error why = {0};
    if (argc == 1) {
        printf("bench-fit: nothing to choose from; see the head of bench/fit.c\n");
        return 0;
    }
    if (!parse(argc, argv, &fit)) {
        fprintf(stderr, "bench-fit: wrong usage; see the head of bench/fit.c\n");
        return 2;
    }
    enum cranny_status status = run_all(&fit, &why);
    if (status != CRANNY_OK)
        fprintf(stderr, "bench-fit: %s\n", why.message);
    else if (!fit.seen)
        printf("bench-fit: SKIPPED: no scenes in CRANNY_SCENES\n");
    else
        print(&fit);
    return cranny_exit_status(status);
}
