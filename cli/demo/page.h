/* The page that shows a bake. */
#ifndef DEMO_PAGE_H
#define DEMO_PAGE_H

#include "frame.h"

#include <stdio.h>

#define VIEW_LIMIT 3

struct page {
    const char *scene_path, *scene_name; /* as given; its last part */
    const char *folder, *output_name;    /* of the page; of the baked file in it */
    int width, height, view_count;       /* pictures before-N.png and after-N.png, N from 1 */
    const char *view_names[VIEW_LIMIT];
    struct cranny_scene_info info;
    struct cranny_bake_params params;
    struct cranny_bake_report report;
    double seconds_load, seconds_write, seconds_total;
    struct frame frame;
    double seconds_frame;
};

/* The section on the frame; a sentence where there is none. */
void page_frame(FILE *out, const struct page *page);

enum cranny_status page_write(const struct page *page, const char *path, struct cranny_error *why);

#endif
