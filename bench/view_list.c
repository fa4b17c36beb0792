/* The views of bench/views.c as words of a command line, for commands that take several scenes:
 *
 *     eval build/cli/cranny tune $(build/bench/bench-view-list) --size 640x360 --method hbao
 *
 * Scenes that CRANNY_SCENES lacks are left out. */
#include "views.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* In quotes for a shell, whatever is in it. */
static void print_word(const char *word)
{
    putchar('\'');
    for (; *word; word++)
        if (*word == '\'')
            fputs("'\\''", stdout);
        else
            putchar(*word);
    putchar('\'');
}

static void print_view(const struct view *view)
{
    if (view->fov_y > 0)
        printf(" --view %s=%g,%g,%g:%g,%g,%g:%g", view->name, view->eye[0], view->eye[1],
               view->eye[2], view->target[0], view->target[1], view->target[2],
               (double)view->fov_y);
    else
        printf(" --view 0");
}

int main(void)
{
    for (int v = 0; v < view_count; v++) {
        char *path = view_path(&views[v]);
        if (path && (v == 0 || strcmp(views[v - 1].scene, views[v].scene) != 0)) {
            putchar(' ');
            print_word(path);
            printf(" --radius %g", (double)views[v].radius_world);
        }
        if (path)
            print_view(&views[v]);
        free(path);
    }
    putchar('\n');
    return 0;
}
