/* Several samples a pixel: what becomes of silhouettes. */
#include "conformance/conformance.h"

static const double radius = 0.5;

/* A ball, open, before a dark gully: what is wrong at the silhouette stands out. */
static void build_silhouette(struct analytic *world)
{
    scenes[SCENE_GULLY].build(world);
    add_sphere(world, 0.05, 1.6, 0.7, 0.25);
}

/* The lens of what pixels see `dx`, `dy` pixels off their centres. */
static struct cranny_projection shifted_lens(double dx, double dy)
{
    struct cranny_projection lens = usual_lens();
    const float x = (float)(dx / TILE_WIDTH) * (lens.right - lens.left);
    const float y = (float)(dy / TILE_HEIGHT) * (lens.bottom - lens.top);
    lens.left += x;
    lens.right += x;
    lens.top += y;
    lens.bottom += y;
    return lens;
}

static struct view sample_view(double dx, double dy)
{
    struct analytic world = {0};
    build_silhouette(&world);
    return view_make(&world, &scenes[SCENE_GULLY].camera, shifted_lens(dx, dy), TILE_WIDTH,
                     TILE_HEIGHT);
}

/* A frame of `count` samples; each alone is a view, too. */
struct samples {
    int count;
    struct view views[CRANNY_SAMPLES_MAX];
    float *depth, (*normals)[3];
    struct cranny_gbuffer frame;
};

static struct samples samples_make(int count)
{
    struct samples s = {.count = count};
    s.depth = floats((size_t)count * TILE_PIXELS);
    s.normals = (float(*)[3])floats((size_t)count * 3 * TILE_PIXELS);
    const float(*places)[2] = cranny_sample_positions(count);
    for (int i = 0; i < count; i++) {
        s.views[i] = sample_view((double)places[i][0] - 0.5, (double)places[i][1] - 0.5);
        memcpy(s.depth + i * TILE_PIXELS, s.views[i].depth, TILE_PIXELS * sizeof *s.depth);
        memcpy(s.normals + i * TILE_PIXELS, s.views[i].normals, TILE_PIXELS * sizeof *s.normals);
    }
    s.frame = (struct cranny_gbuffer){.width = TILE_WIDTH,
                                      .height = TILE_HEIGHT,
                                      .depth = s.depth,
                                      .normal = s.normals,
                                      .projection = usual_lens(),
                                      .sample_count = count};
    return s;
}

static void samples_free(struct samples *s)
{
    for (int i = 0; i < s->count; i++)
        view_free(&s->views[i]);
    free(s->depth);
    free(s->normals);
}

/* Whether a pixel's samples lie on the ball and behind it. */
static bool is_silhouette(const struct samples *s, int at)
{
    float least = INFINITY, most = 0;
    for (int i = 0; i < s->count; i++) {
        least = fminf(least, s->views[i].depth[at]);
        most = fmaxf(most, s->views[i].depth[at]);
    }
    return most - least > 0.3f;
}

static double truth_of_hit(const struct analytic *scene, const double d[3])
{
    static const double eye[3] = {0, 0, 0};
    const struct analytic_hit hit = analytic_trace(scene, eye, d);
    double p[3];
    if (!isfinite(hit.distance))
        return 1;
    for (int k = 0; k < 3; k++)
        p[k] = hit.distance * d[k] + 1e-6 * hit.normal[k];
    return truth_at(scene, p, hit.normal, radius, 16);
}

/* Ray-traced, 8×8 places in each silhouette pixel, one place in others. */
static float *fine_truth(const struct samples *s)
{
    const struct cranny_projection lens = usual_lens();
    const struct analytic *scene = &s->views[0].scene;
    float *truth = floats(TILE_PIXELS);
#pragma omp parallel for schedule(dynamic, 2)
    for (int y = 0; y < TILE_HEIGHT; y++)
        for (int x = 0; x < TILE_WIDTH; x++) {
            const int at = y * TILE_WIDTH + x, side = is_silhouette(s, at) ? 8 : 1;
            double sum = 0;
            for (int i = 0; i < side * side; i++) {
                const double px = x + (i % side + 0.5) / side, py = y + (i / side + 0.5) / side;
                const double d[3] = {lens.left + px / TILE_WIDTH * ((double)lens.right - lens.left),
                                     lens.top + py / TILE_HEIGHT * ((double)lens.bottom - lens.top),
                                     -1};
                sum += truth_of_hit(scene, d);
            }
            truth[at] = (float)(sum / (side * side));
        }
    return truth;
}

/* The method itself, on each sample's frame alone. */
static float *each_alone(const struct samples *s, int method)
{
    float *mean = floats(TILE_PIXELS);
    for (int i = 0; i < s->count; i++) {
        float *one = render_view(&s->views[i], method, radius);
        for (int k = 0; k < TILE_PIXELS; k++)
            mean[k] += one[k] / (float)s->count;
        free(one);
    }
    return mean;
}

static double silhouette_error(const struct samples *s, const float *a, const float *b)
{
    double sum = 0;
    int count = 0;
    for (int i = 0; i < TILE_PIXELS; i++) {
        const int x = i % TILE_WIDTH, y = i / TILE_WIDTH;
        if (!view_counts(&s->views[0], x, y, 1e6) || !is_silhouette(s, i))
            continue;
        sum += ((double)a[i] - (double)b[i]) * ((double)a[i] - (double)b[i]);
        count++;
    }
    CHECK_MSG(count > 50, "only %d pixels at the silhouette", count);
    return sqrt(sum / count);
}

static float *resolved(const struct samples *s, int method, int resolve)
{
    struct cranny_screen_params params = method_params(method, NULL, radius);
    params.resolve = resolve;
    return render(&s->frame, &params);
}

/* An enlarged part of a picture that holds a piece of the silhouette. */
static float *enlarge(const float *picture)
{
    enum { ZOOM = 4, X = 44, Y = 20 };
    float *part = floats(TILE_PIXELS);
    for (int y = 0; y < TILE_HEIGHT; y++)
        for (int x = 0; x < TILE_WIDTH; x++)
            part[y * TILE_WIDTH + x] = picture[(Y + y / ZOOM) * TILE_WIDTH + X + x / ZOOM];
    return part;
}

static void write_picture(const char *folder, const struct samples *s, const float *truth)
{
    float *pictures[5] = {enlarge(truth)};
    for (int r = CRANNY_RESOLVE_FIRST; folder && r <= CRANNY_RESOLVE_BLUR; r++) {
        float *whole = resolved(s, CRANNY_ALCHEMY, r);
        pictures[2 + r] = enlarge(whole);
        free(whole);
    }
    float *alone = each_alone(s, CRANNY_ALCHEMY);
    pictures[1] = enlarge(alone);
    free(alone);
    strip_write(folder, "samples", pictures, 5, TILE_WIDTH, TILE_HEIGHT);
    for (int i = 0; i < 5; i++)
        free(pictures[i]);
}

void measure_samples(const char *folder)
{
    static const enum row_id alone_ids[] = {ROW_FIRST_4, ROW_FIRST_8};
    for (int k = 0; k < 2; k++) {
        struct samples s = samples_make(k ? 8 : 4);
        float *truth = fine_truth(&s);
        for (int m = 0; m < CRANNY_METHOD_COUNT; m++) {
            float *alone = each_alone(&s, m);
            double errors[3], from_truth[3];
            for (int r = CRANNY_RESOLVE_FIRST; r <= CRANNY_RESOLVE_BLUR; r++) {
                float *visibility = resolved(&s, m, r);
                errors[r] = silhouette_error(&s, visibility, alone);
                from_truth[r] = silhouette_error(&s, visibility, truth);
                record((enum row_id)(alone_ids[k] + r), m, false, errors[r]);
                record((enum row_id)(ROW_FIRST_TRUTH + r), m, false, from_truth[r]);
                CHECK_MSG(errors[r] <= errors[0] && from_truth[r] <= from_truth[0],
                          "%s, %d samples, resolve %d: %.4f and %.4f, first has %.4f and %.4f",
                          cranny_method_name((enum cranny_method)m), s.count, r, errors[r],
                          from_truth[r], errors[0], from_truth[0]);
                free(visibility);
            }
            free(alone);
        }
        if (k == 0)
            write_picture(folder, &s, truth);
        free(truth);
        samples_free(&s);
    }
}
