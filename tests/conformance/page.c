/* docs/conformance.md and its pictures. */
#include "conformance/conformance.h"

void strip_write(const char *folder, const char *name, float *const *pictures, int count, int width,
                 int height)
{
    enum { GAP = 4 };
    if (!folder)
        return;
    const int wide = count * width + (count - 1) * GAP;
    uint8_t *grey = calloc((size_t)wide * (size_t)height, 1);
    if (!grey)
        return;
    memset(grey, 255, (size_t)wide * (size_t)height);
    for (int k = 0; k < count; k++)
        for (int y = 0; y < height; y++)
            for (int x = 0; x < width; x++)
                grey[y * wide + k * (width + GAP) + x] =
                    (uint8_t)(pictures[k][y * width + x] * 255 + 0.5f);
    char path[1024];
    struct cranny_error why;
    snprintf(path, sizeof path, "%s/conformance/%s.png", folder, name);
    CHECK_OK(cranny_png_write(path, wide, height, 1, grey, (size_t)wide, &why), why);
    free(grey);
}

static const char *const headings[SECTION_COUNT] = {
    "Planes and closed forms", "What must not change the picture", "Several samples a pixel",
    "Noise and its filter"};

static const char *const prose[SECTION_COUNT] = {
    "Numbers are of visibility, 0 to 1. *Darkening* is the most that an open surface loses; *rms* "
    "and *largest* are over all pixels, 8 at the border left out. The truth is ray-traced "
    "obscurance with linear falloff over the radius, 1024 stratified rays a pixel; the rays "
    "themselves are checked against creases of 90°, 60° and three planes, whose visibility is ½, "
    "¼ and ¼. Much of the largest errors is what no depth buffer shows: hidden sides, and what "
    "lies behind silhouettes.",
    "Mean absolute difference between two pictures of the court; where the camera moves, between "
    "points of surfaces that both show. What differs between such pictures is noise that sits on "
    "the screen, and pixels that are snapped to, unless said otherwise.",
    "A ball before the gully; rms at the pixels of its silhouette. *Apart*: against rendering "
    "every sample's frame alone and taking the mean. *Truth*: against ray-traced visibility, 64 "
    "places a pixel. `cross` and `blur` must both be nearer than `first`, in every row.",
    "*Smear*: within 4 pixels of the ball's silhouette, filtered against the mean of 16 unfiltered "
    "seeds, on each side. *Pattern*: amplitude of the strongest wave with a period of 4 or 2 "
    "pixels, on the wall and in the gully. There is no seam where tiles of the estimators meet: "
    "a viewport elsewhere in the buffer, which is cut elsewhere, gives the same picture (above)."};

static void write_cell(FILE *page, double measured, double bound)
{
    if (isnan(measured))
        fprintf(page, " – |");
    else if (isnan(bound))
        fprintf(page, " %.4f |", measured);
    else
        fprintf(page, " %.4f ≤ %.3g |", measured, bound);
}

static void write_table(FILE *page, enum section section, bool paper)
{
    fprintf(page, "\n| |");
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++)
        fprintf(page, " %s |", cranny_method_name((enum cranny_method)m));
    fprintf(page, "\n|---|---|---|---|---|---|\n");
    int note = 0;
    for (int i = 0; i < ROW_COUNT; i++) {
        const struct row *row = &rows[i];
        note += row->limit != NULL;
        if (row->section != section)
            continue;
        fprintf(page, "| %s", row->what);
        if (row->limit && !paper)
            fprintf(page, " <sup>%d</sup>", note);
        fprintf(page, " |");
        for (int m = 0; m < CRANNY_METHOD_COUNT; m++)
            write_cell(page, paper ? row->paper[m] : row->measured[m], paper ? NAN : row->bound[m]);
        fprintf(page, "\n");
    }
}

static void write_notes(FILE *page)
{
    fprintf(
        page,
        "\n## Known limits\n\n"
        "- A depth buffer shows the nearest surface: the underside of a ball hides its contact "
        "shadow's cause, so that only the ray marcher, which takes what is seen to be as thick "
        "as the radius, comes near the truth there.\n"
        "- Depth of 16 bits in Direct3D's convention has steps that grow with the square of the "
        "distance; what is left is within the bounds above at 4 m from a near plane at 0.1 m.\n"
        "- The presets `paper` keep what was published: grey flats and a kernel of the screen "
        "for ssao, reads of the frame's edge at its border.\n");
    for (int i = 0; i < ROW_COUNT; i++)
        if (rows[i].limit)
            fprintf(page, "- *%s*: %s\n", rows[i].what, rows[i].limit);
}

static void write_head(FILE *page)
{
    fprintf(page,
            "# Conformance of the screen-space methods\n\n"
            "What each method makes of scenes whose truth is known, and what must not change its "
            "picture: measured value ≤ bound that `tests/conformance.c` enforces. Preset "
            "`calibrated`, radius 0.5 m, %d×%d pixels, a lens of 52° high.\n\n"
            "This page and its pictures are written by the test itself:\n\n"
            "    cmake --preset release && cmake --build build --target test_conformance\n"
            "    build/tests/test_conformance --write docs\n\n"
            "Without the option it only checks, as `ctest -R conformance` does. All bounds stand "
            "in one table at the top of the test.\n\n"
            "## Pictures\n\n"
            "From left to right: truth, ssao, hbao, crease, alchemy, raymarch.\n",
            TILE_WIDTH, TILE_HEIGHT);
    for (int i = 0; i < SCENE_COUNT; i++)
        fprintf(page, "\n%s (`%s`):\n\n![%s](conformance/%s.png)\n", scenes[i].title,
                scenes[i].name, scenes[i].title, scenes[i].name);
}

void page_write(const char *folder)
{
    char path[1024], *text = NULL;
    size_t size = 0;
    struct cranny_error why;
    FILE *page = open_memstream(&text, &size);
    if (!page)
        return;
    write_head(page);
    for (int s = 0; s < SECTION_COUNT; s++) {
        fprintf(page, "\n## %s\n\n%s\n", headings[s], prose[s]);
        write_table(page, (enum section)s, false);
        if (s == SECTION_FORMS) {
            fprintf(page, "\nThe same with the preset `paper` (reported, not enforced):\n");
            write_table(page, SECTION_FORMS, true);
        }
        if (s == SECTION_SAMPLES)
            fprintf(page, "\nAlchemy with 4 samples, a piece of the silhouette: truth, apart, "
                          "`first`, `cross`, `blur`:\n\n![a ball's silhouette]"
                          "(conformance/samples.png)\n");
    }
    write_notes(page);
    fclose(page);
    snprintf(path, sizeof path, "%s/conformance.md", folder);
    CHECK_OK(cranny_file_write(path, text, size, &why), why);
    free(text);
}
