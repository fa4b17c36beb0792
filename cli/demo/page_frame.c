/* The page's section on one frame: estimates from depth and normals beside the truth. */
#include "html.h"
#include "page.h"

#include <unistd.h>

/* What a reader looks at: where a method comes from, what it does, what it cannot know. */
struct about {
    const char *title, *words;
};

static const struct about about[FRAME_METHOD_COUNT] = {
    {"Kajalin 2009, the occlusion of Crysis",
     "Points strewn over the half-sphere above the surface; those that lie behind what the depth "
     "buffer shows count as blocked. How thick things are is a guess: 16 points find a thin rail "
     "or miss it, and the filter spreads what they found."},
    {"Bavoil and Sainz 2009, horizons",
     "Walks along a few directions of the picture and keeps the highest horizon in each; light "
     "comes from above it. The depth buffer is taken for a landscape: nothing passes behind a "
     "post or under a table, so a dark rim may grow around what stands in front."},
    {"Fox and Compton 2008, creases",
     "Each neighbour that rises over the surface’s plane darkens it a little; the sum is not an "
     "integral of anything, but finds the creases that an eye looks for. Wide, shallow occlusion "
     "comes out too weak."},
    {"McGuire and others 2011, obscurance",
     "Samples on a spiral; one fraction weighs how far each stands over the surface against the "
     "square of its distance, derived from the integral itself. Occluders overlap without knowing "
     "of each other, so narrow places may be counted twice."},
    {"McGuire 2009, ambient occlusion volumes",
     "Not from the depth buffer: it has the scene’s polygons, and a formula for the share of the "
     "half-sphere that each one near the pixel hides. Nothing is out of sight and there is no "
     "noise. Polygons that cover each other from the pixel are counted both, which a bend of their "
     "sum makes up for on average. The more of them are near, the longer it takes."},
};

static const char *name_of(int index)
{
    return methods[frame_methods[index]].name;
}

static void intro(FILE *out, const struct page *page)
{
    const struct frame *frame = &page->frame;
    fputs(
        "<p>A renderer whose things move cannot look baked values up. It has the depth and "
        "the normals of one picture, and guesses from these how open each pixel is: anything "
        "hidden or outside the picture does not exist for it. The last method here has the scene, "
        "too. This is the view <em>",
        out);
    html_text(out, page->view_names[frame->view]);
    fprintf(out,
            "</em> at %d × %d. The truth sends %d rays a pixel into the whole scene; an occluder "
            "counts less the farther it is, and not at all beyond a radius of %s m: a tenth of the "
            "picture’s height at the median depth, %.3g m. A bake looks farther, so its pictures "
            "above are darker.</p>\n",
            FRAME_WIDTH, FRAME_HEIGHT, frame->rays, frame->radius, frame->depth_median);
}

static void lit(FILE *out)
{
    static const struct split split = {"frame-open.png",
                                       "frame-lit.png",
                                       "without",
                                       "with visibility",
                                       "The scene's colours under even ambient light",
                                       "The same, times the visibility that alchemy estimates",
                                       "ambient light in the frame",
                                       FRAME_WIDTH,
                                       FRAME_HEIGHT};
    fputs("<figure class=\"lit\">\n", out);
    html_split(out, &split);
    fputs("<figcaption>What it is for: the scene’s own colours under ambient light alone, a "
          "little brighter from above, times the visibility that alchemy estimates. No lamp, no "
          "shadow; both halves have one exposure.</figcaption>\n</figure>\n",
          out);
}

static void method(FILE *out, int index)
{
    const char *name = name_of(index);
    char file[64], alt[96], label[96];
    snprintf(file, sizeof file, "frame-%s.png", name);
    snprintf(alt, sizeof alt, "Visibility as %s estimates it", name);
    snprintf(label, sizeof label, "truth beside %s", name);
    const struct split split = {"frame-truth.png",
                                file,
                                "truth",
                                name,
                                "Ray-traced visibility, white is open",
                                alt,
                                label,
                                FRAME_WIDTH,
                                FRAME_HEIGHT};
    fputs("<figure>\n", out);
    html_split(out, &split);
    fprintf(out, "<figcaption><strong>%s</strong> (%s). %s</figcaption>\n</figure>\n", name,
            about[index].title, about[index].words);
}

static void scores(FILE *out, const struct frame *frame)
{
    const long cores = sysconf(_SC_NPROCESSORS_ONLN);
    fputs("<h3>Time and error</h3>\n<table class=\"scores\">\n<thead><tr><th scope=\"col\">method"
          "</th><th scope=\"col\">time</th><th scope=\"col\">error</th><th scope=\"col\">mean "
          "shift</th></tr></thead>\n<tbody>\n",
          out);
    for (int i = 0; i < FRAME_METHOD_COUNT; i++) {
        const struct frame_score *score = &frame->scores[i];
        fprintf(out,
                "<tr><th scope=\"row\">%s</th><td>%.1f ms</td><td>%.3f</td><td>%+.3f</td></tr>\n",
                name_of(i), score->milliseconds, score->difference.error, score->difference.mean);
    }
    fprintf(out,
            "<tr><th scope=\"row\">truth, %d rays</th><td>%.0f ms</td><td>0</td><td>0</td></tr>\n"
            "</tbody></table>\n",
            frame->rays, 1000 * frame->truth.seconds);
    fprintf(out,
            "<p>Times are the median of %d frames on this machine (%ld core%s, %s), whatever else "
            "it did meanwhile. Error is equation 31 of McGuire’s <em>Ambient Occlusion "
            "Volumes</em>: 0 is equal; it weighs wrong tones and wrong edges on a logarithmic "
            "scale, the dark ones most. The shift is the mean of estimate minus truth: below 0 is "
            "too dark. The truth itself has noise, a standard error of %.4f a pixel.</p>\n",
            FRAME_RUNS, cores, cores == 1 ? "" : "s", frame->isa, frame->truth.standard_error_mean);
    for (int i = 0; i < FRAME_METHOD_COUNT; i++)
        if (frame->scores[i].setup_s > 0)
            fprintf(out,
                    "<p>What %s keeps while the scene stands still took %.2f s to make, once; that "
                    "is not in its time.</p>\n",
                    name_of(i), frame->scores[i].setup_s);
}

static void maps(FILE *out)
{
    fputs("<h3>Where they err</h3>\n<p>Red gathers where the occluder is out of sight: seen from "
          "behind, or hidden. Blue lies around what stands in front of something far; "
          "where volumes are blue, many polygons overlap.</p>\n"
          "<div class=\"maps\">\n",
          out);
    for (int i = 0; i < FRAME_METHOD_COUNT; i++)
        fprintf(out,
                "<figure><img src=\"frame-%s-map.png\" width=\"%d\" height=\"%d\" alt=\"Map of the "
                "errors of %s\">\n<figcaption>%s</figcaption></figure>\n",
                name_of(i), FRAME_WIDTH, FRAME_HEIGHT, name_of(i), name_of(i));
    fprintf(out,
            "</div>\n<div class=\"legend\"><i></i><div><span>%.2f too dark</span><span>equal</span>"
            "<span>%.2f too bright</span></div></div>\n",
            FRAME_MAP_SCALE, FRAME_MAP_SCALE);
}

static void render(FILE *out, const struct page *page, const char *options, const char *file)
{
    fputs("cranny render ", out);
    html_shell_word(out, page->scene_path);
    fprintf(out, " %s --size %dx%d --radius %s %s -o frame-%s.png\n", page->frame.view_words,
            FRAME_WIDTH, FRAME_HEIGHT, page->frame.radius, options, file);
}

static void commands(FILE *out, const struct page *page)
{
    char options[96];
    fputs("<h3>Render it yourself</h3>\n<p>These make the pictures of this section, byte for "
          "byte but for the maps, which here know more than 8 bits.</p>\n<pre>",
          out);
    snprintf(options, sizeof options, "--method raytrace --rays %d", page->frame.rays);
    render(out, page, options, "truth");
    for (int i = 0; i < FRAME_METHOD_COUNT; i++) {
        snprintf(options, sizeof options, "--method %s", name_of(i));
        render(out, page, options, name_of(i));
    }
    snprintf(options, sizeof options, "--lit --exposure %s", page->frame.exposure);
    render(out, page, options, "lit");
    snprintf(options, sizeof options, "--lit --exposure %s --intensity 0", page->frame.exposure);
    render(out, page, options, "open");
    for (int i = 0; i < FRAME_METHOD_COUNT; i++)
        fprintf(out, "cranny diff frame-%s.png frame-truth.png --map frame-%s-map.png\n",
                name_of(i), name_of(i));
    fputs("</pre>\n", out);
}

void page_frame(FILE *out, const struct page *page)
{
    fputs("<h2 id=\"frame\">In a frame</h2>\n", out);
    if (!page->frame.made) {
        fputs("<p>Left out: in none of these views is anything near enough to a surface to "
              "darken it.</p>\n",
              out);
        return;
    }
    intro(out, page);
    lit(out);
    fputs("<h3>Truth and estimates</h3>\n<div class=\"pairs\">\n", out);
    for (int i = 0; i < FRAME_METHOD_COUNT; i++)
        method(out, i);
    fputs("</div>\n", out);
    scores(out, &page->frame);
    maps(out);
    commands(out, page);
    fprintf(out, "<p>The section took %.1f s.</p>\n", page->seconds_frame);
}
