/* cranny render --depth and check --depth from outside: every convention of depth gives the picture
 * that the scene itself gives, and what is wrong is said. */
#include "render_files.h"

#define WIDTH "160"
#define SIZE "160x120"
#define VIEW "--fov", "45.8366236"

static float nan_depth(void)
{
    return NAN;
}

static void write_depth(const char *path, const struct cranny_image *depth,
                        const struct cranny_depth_layout *layout)
{
    struct cranny_image stored = *depth;
    const size_t count = (size_t)depth->width * (size_t)depth->height;
    stored.pixels = malloc(count * sizeof(float));
    for (size_t i = 0; i < count; i++)
        stored.pixels[i] = cranny_depth_encode(layout, depth->pixels[i]);
    write_image(path, CRANNY_IMAGE_DEPTH, CRANNY_IMAGE_AUTO, &stored);
    free(stored.pixels);
}

/* Every pixel changed by `change`, or set to `change(0)` when it is NaN. */
static void write_scaled(const char *path, enum cranny_image_bits bits,
                         const struct cranny_image *depth, float factor)
{
    struct cranny_image stored = *depth;
    const size_t count = (size_t)depth->width * (size_t)depth->height;
    stored.pixels = malloc(count * sizeof(float));
    for (size_t i = 0; i < count; i++)
        stored.pixels[i] = isnan(factor) ? nan_depth() : depth->pixels[i] * factor;
    write_image(path, CRANNY_IMAGE_DEPTH, bits, &stored);
    free(stored.pixels);
}

/* How a layout is named on the command line. */
struct convention {
    struct cranny_depth_layout layout;
    const char *options[8];
    double tolerance;
};

static const struct convention conventions[] = {
    {{.kind = CRANNY_DEPTH_VIEW_Z}, {"--depth-kind", "view-z"}, 1.0 / 255},
    {{.kind = CRANNY_DEPTH_NORMALIZED, .near_plane = 1, .far_plane = 20},
     {"--depth-kind", "normalized", "--near", "1", "--far", "20"},
     1.0 / 255},
    {{.kind = CRANNY_DEPTH_DEVICE, .near_plane = 0.5f, .far_plane = 50},
     {"--depth-kind", "device", "--near", "0.5", "--far", "50"},
     1.0 / 255},
    {{.kind = CRANNY_DEPTH_DEVICE, .near_plane = 0.5f, .far_plane = 50, .gl_range = true},
     {"--depth-kind", "device", "--near", "0.5", "--far=50", "--depth-range", "gl"},
     1.0 / 255},
    {{.kind = CRANNY_DEPTH_DEVICE, .near_plane = 0.1f, .far_plane = INFINITY, .reversed = true},
     {"--depth-kind", "device", "--near", "0.1", "--reversed"},
     1.0 / 255},
    {{.kind = CRANNY_DEPTH_DEVICE, .near_plane = 0.1f, .far_plane = INFINITY},
     {"--depth-kind", "device", "--near", "0.1", "--far", "inf"},
     1.0 / 255},
    {{.kind = CRANNY_DEPTH_LOGARITHMIC, .far_plane = 100, .log_constant = 2},
     {"--depth-kind", "logarithmic", "--far", "100", "--log-c", "2"},
     1.0 / 255},
};
enum { CONVENTION_COUNT = sizeof conventions / sizeof *conventions };

static void test_conventions(const struct cranny_image *depth)
{
    for (int i = 0; i < CONVENTION_COUNT; i++) {
        const struct convention *c = &conventions[i];
        const char *const *o = c->options;
        write_depth("stored.pfm", depth, &c->layout);
        CHECK_RUN("render", "--depth", "stored.pfm", "--normal", "frame-normal.exr", "-o",
                  "read.pfm", VIEW, o[0], o[1], o[2], o[3], o[4], o[5], o[6]);
        CHECK_MSG(largest_difference("direct.pfm", "read.pfm") <= c->tolerance,
                  "convention %d differs by %g", i, largest_difference("direct.pfm", "read.pfm"));
        CHECK_RUN("check", "--depth", "stored.pfm", VIEW, o[0], o[1], o[2], o[3], o[4], o[5], o[6]);
    }
    write_scaled("mm.png", CRANNY_IMAGE_BITS16, depth, 1 / 65.535f);
    CHECK_RUN("render", "--depth", "mm.png", "--normal", "frame-normal.exr", VIEW, "--depth-scale",
              "65.535", "--far", "65", "-o", "read.pfm");
    CHECK_MSG(largest_difference("direct.pfm", "read.pfm") < 0.1, "millimetres differ by %g",
              largest_difference("direct.pfm", "read.pfm"));
    unlink("stored.pfm");
    unlink("read.pfm");
    unlink("mm.png");
}

static void test_normals(void)
{
    struct cranny_image normal = read_image("frame-normal.exr", CRANNY_IMAGE_NORMAL);
    const int count = 3 * normal.width * normal.height;
    for (int i = 0; i < count; i++)
        normal.pixels[i] = 0.5f * normal.pixels[i] * (i % 3 == 0 ? 1.f : -1.f) + 0.5f;
    write_image("half.png", CRANNY_IMAGE_NORMAL, CRANNY_IMAGE_BITS16, &normal);
    write_image("half.pfm", CRANNY_IMAGE_NORMAL, CRANNY_IMAGE_AUTO, &normal);
    CHECK_RUN("render", "--depth", "frame-depth.exr", "--normal", "half.png", VIEW, "--normal-flip",
              "yz", "-o", "read.pfm");
    CHECK(largest_difference("direct.pfm", "read.pfm") < 1.0 / 255);
    CHECK_RUN("render", "--depth", "frame-depth.exr", "--normal", "half.pfm", VIEW,
              "--normal-flip=yz", "--normal-range", "unsigned", "-o", "read.pfm");
    CHECK(largest_difference("direct.pfm", "read.pfm") < 1.0 / 255);
    struct result result =
        run("check", "--depth", "frame-depth.exr", "--normal", "half.png", VIEW, NULL);
    CHECK_EXIT(result, 3);
    CHECK_TEXT(result.out, "error: normal-");
    done(&result);
    result = run("check", "--depth", "frame-depth.exr", "--normal", "half.pfm", VIEW, NULL);
    CHECK_EXIT(result, 3);
    CHECK_TEXT(result.out, "normal-range");
    CHECK_TEXT(result.out, "--normal-range unsigned");
    done(&result);
    cranny_image_free(&normal);
    unlink("half.png");
    unlink("half.pfm");
    unlink("read.pfm");
}

/* A guard band inside the image is a viewport with that much around it. */
static void test_viewport(void)
{
    CHECK_RUN("render", "--depth", "frame-depth.exr", VIEW, "--guard", "10", "-o", "inner.pfm");
    CHECK_RUN("render", "--depth", "frame-depth.exr", VIEW, "--guard", "10", "--viewport",
              "10,10,140,100", "-o", "named.pfm");
    CHECK(same_files("inner.pfm", "named.pfm"));
    struct cranny_image inner = read_image("inner.pfm", CRANNY_IMAGE_VALUE);
    CHECK(inner.width == 140 && inner.height == 100);
    cranny_image_free(&inner);
    CHECK_RUN("render", "--depth", "frame-depth.exr", "--ortho", "2", "-o", "inner.pfm");
    unlink("inner.pfm");
    unlink("named.pfm");
}

static void test_usage(void)
{
    static const struct {
        const char *part, *arguments[8];
    } cases[] = {
        {"--reversed: linear depth has none", {"--reversed"}},
        {"--near: view-z depth has none", {"--near", "1", "--depth-kind", "view-z"}},
        {"--depth-range: linear", {"--depth-range", "gl"}},
        {"needs the camera's --near", {"--depth-kind", "device", "--far", "10"}},
        {"needs the camera's --far, inf", {"--depth-kind", "device", "--near", "1"}},
        {"needs the camera's --far", {"--depth-kind", "normalized", "--near", "1"}},
        {"needs the camera's --far", {"--depth-kind", "logarithmic"}},
        {"must be finite", {"--depth-kind", "normalized", "--near", "1", "--far", "inf"}},
        {"not beyond --near", {"--depth-kind", "device", "--near", "2", "--far", "1"}},
        {"--depth-scale goes with",
         {"--depth-kind=device", "--near=1", "--reversed", "--depth-scale=2"}},
        {"--log-c goes with", {"--log-c", "1"}},
        {"--depth-scale: must be finite", {"--depth-scale", "inf"}},
        {"--far: '0' is not a number above 0", {"--far", "0"}},
        {"--far: 'nan'", {"--far", "nan"}},
        {"linear, view-z, normalized", {"--depth-kind", "ndc"}},
        {"d3d, gl", {"--depth-range", "vulkan"}},
        {"--normal-flip: 'w'", {"--normal-flip", "w"}},
        {"--normal-flip: 'xx'", {"--normal-flip", "xx"}},
        {"auto, signed, unsigned", {"--normal-range", "half"}},
        {"X,Y,WIDTH,HEIGHT", {"--viewport", "0,0,5"}},
        {"X,Y,WIDTH,HEIGHT", {"--viewport", "0,0,0,5"}},
        {"--viewport: reaches beyond", {"--viewport", "1,0," WIDTH ",5"}},
        {"--guard: 60 pixels leave nothing", {"--guard", "60"}},
        {"--fov and --ortho", {"--fov", "60", "--ortho", "1"}},
        {"--scene goes with a scene", {"--scene", "0"}},
        {"one input at a time", {"view.gltf"}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const char *const *a = cases[i].arguments;
        static const char *const commands[] = {"render", "check"};
        for (int k = 0; k < 2; k++)
            check_failure(run(commands[k], "--depth", "frame-depth.exr", a[0], a[1], a[2], a[3],
                              a[4], a[5], NULL),
                          2, cases[i].part);
    }
    check_failure(run("render", "--depth", "frame-depth.exr", "--method", "raytrace", NULL), 2,
                  "needs a scene");
    check_failure(run("render", "--depth", "frame-depth.exr", "--lit", NULL), 2, "--lit");
    check_failure(run("render", "--depth", "frame-depth.exr", "--gbuffer", "x", NULL), 2,
                  "--gbuffer");
    check_failure(run("render", "--depth", "frame-depth.exr", "--size", "9x9", NULL), 2, "--size");
    check_failure(run("render", "--depth", "frame-depth.exr", "-o", "frame-depth.exr", NULL), 2,
                  "is the input");
    check_failure(run("check", "view.gltf", "--fov", "60", NULL), 2, "--fov goes with --depth");
    check_failure(run("check", NULL), 2, "no scene and no --depth");
}

static void check_broken(const char *part, const char *depth, const char *normal)
{
    static const char *const commands[] = {"render", "check"};
    for (int k = 0; k < 2; k++)
        check_failure(
            run(commands[k], "--depth", depth, VIEW, normal ? "--normal" : NULL, normal, NULL), 3,
            part);
}

static void test_broken(const struct cranny_image *depth)
{
    size_t size;
    char *data = read_file("frame-depth.exr", &size);
    write_file("cut.exr", data, size / 2);
    write_file("empty.exr", data, 0);
    free(data);
    write_scaled("grey.png", CRANNY_IMAGE_BITS8, depth, 0.05f);
    write_scaled("nan.pfm", CRANNY_IMAGE_AUTO, depth, NAN);
    check_broken("cut.exr", "cut.exr", NULL);
    check_broken("empty.exr", "empty.exr", NULL);
    check_broken("nowhere.exr", "nowhere.exr", NULL);
    check_broken("cut.exr", "frame-depth.exr", "cut.exr");
    check_broken("pass --depth-scale 65.535", "grey.png", NULL);
    check_failure(run("render", "--depth", "grey.png", "--depth-kind=device", "--near=1",
                      "--reversed", "--depth-range=gl", NULL),
                  3, "leave out --depth-range gl");
    check_failure(run("render", "--depth", "nan.pfm", VIEW, "-q", NULL), 3, "nan.pfm");
    struct result result = run("check", "--depth", "nan.pfm", VIEW, NULL);
    CHECK_EXIT(result, 3);
    CHECK_TEXT(result.out, "error: depth-empty");
    done(&result);
    result = run("render", "--depth", "grey.png", "--depth-scale", "20", "-o", "out.png", NULL);
    CHECK_EXIT(result, 0);
    CHECK_TEXT(result.err, "no more than 8 bits");
    CHECK_TEXT(result.err, "60 degrees are assumed");
    done(&result);
    struct cranny_image small = *depth;
    small.width /= 2;
    write_image("small.pfm", CRANNY_IMAGE_COLOR, CRANNY_IMAGE_AUTO,
                &(struct cranny_image){4, 4, 3, depth->pixels, false});
    check_failure(run("render", "--depth", "frame-depth.exr", "--normal", "small.pfm", VIEW, NULL),
                  3, "of one frame");
    result = run("check", "--depth", "frame-depth.exr", "--normal", "small.pfm", VIEW, NULL);
    CHECK_EXIT(result, 3);
    CHECK_TEXT(result.out, "error: size-mismatch");
    CHECK_TEXT(result.out, "advice-radius");
    done(&result);
    const char *const made[] = {"cut.exr", "empty.exr", "grey.png",
                                "nan.pfm", "out.png",   "small.pfm"};
    for (int i = 0; i < 6; i++)
        CHECK(unlink(made[i]) == 0);
}

/* Does a finding of that code hold these words? */
static bool has_finding(const json_t *object, const char *code, const char *part)
{
    const json_t *list = json_object_get(object, "findings");
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *finding = json_array_get(list, i);
        if (strcmp(text_of(finding, "code"), code) == 0 && strstr(text_of(finding, "text"), part))
            return true;
    }
    return false;
}

/* Depth as the wrong kind: the doctor names the options, and with them there is nothing to find. */
static void test_doctor(const struct cranny_image *depth)
{
    static const struct {
        int convention;
        const char *code, *words;
    } cases[] = {
        {0, "depth-negative", "pass --depth-kind view-z"},
        {2, "depth-device", "pass --depth-kind device and the camera's --near and --far"},
        {4, "depth-reversed", "pass --depth-kind device, --reversed and"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        write_depth("stored.pfm", depth, &conventions[cases[i].convention].layout);
        struct result result = run("check", "--depth", "stored.pfm", VIEW, "--json", NULL);
        json_t *object = take_json(&result, 3);
        CHECK_MSG(has_finding(object, cases[i].code, cases[i].words), "no %s: %s", cases[i].code,
                  json_dumps(json_object_get(object, "findings"), 0));
        json_decref(object);
        result = run("render", "--depth", "stored.pfm", VIEW, "-o", "out.png", "-v", NULL);
        if (cases[i].convention) {
            CHECK_EXIT(result, 0);
            CHECK_TEXT(result.err, cases[i].words);
        } else
            CHECK_EXIT(result, 3);
        done(&result);
    }
    unlink("stored.pfm");
    unlink("out.png");
}

static void test_advice(void)
{
    static const char *const keys[] = {"radius_world", "bias",         "fade_begin", "fade_end",
                                       "depth_near",   "depth_median", "depth_far",  NULL};
    struct result result = run("check", "--depth", "frame-depth.exr", VIEW, "--json", NULL);
    json_t *object = take_json(&result, 0), *advice = json_object_get(object, "advice");
    check_keys(advice, keys);
    const double median = number_of(advice, "depth_median");
    CHECK_NEAR(number_of(advice, "radius_world"), 0.1 * 2 * tan(0.4) * median, 1e-3);
    CHECK(has_finding(object, "advice-radius", "--radius"));
    json_decref(object);
    result = run("check", "--depth", "frame-depth.exr", NULL);
    CHECK_EXIT(result, 0);
    CHECK_TEXT(result.out, "neither --fov nor --ortho was given");
    done(&result);
    result = run("check", "--depth", "frame-depth.exr", "--ortho", "1", "--json", NULL);
    object = take_json(&result, 0);
    CHECK(json_is_null(json_object_get(json_object_get(object, "advice"), "fade_end")));
    json_decref(object);
}

static void test_one_pixel(void)
{
    static float depth = 2;
    const struct cranny_image one = {1, 1, 1, &depth, false};
    write_image("one.pfm", CRANNY_IMAGE_DEPTH, CRANNY_IMAGE_AUTO, &one);
    CHECK_RUN("render", "--depth", "one.pfm", VIEW, "-o", "out.pfm");
    CHECK_RUN("check", "--depth", "one.pfm", VIEW);
    depth = INFINITY;
    write_image("one.pfm", CRANNY_IMAGE_DEPTH, CRANNY_IMAGE_AUTO, &one);
    CHECK_RUN("render", "--depth", "one.pfm", VIEW, "-o", "out.pfm");
    struct cranny_image sky = read_image("out.pfm", CRANNY_IMAGE_VALUE);
    CHECK(sky.pixels && sky.pixels[0] == 1);
    cranny_image_free(&sky);
    unlink("one.pfm");
    unlink("out.pfm");
}

int main(void)
{
    if (!cranny_image_has_exr())
        return check_skip("render_depth", "built without OpenEXR");
    char folder[] = "depth-XXXXXX";
    CHECK(mkdtemp(folder) && chdir(folder) == 0);
    write_scene("view.gltf");
    CHECK_RUN("render", "view.gltf", "--size", SIZE, "--guard", "0", "--gbuffer", "frame", "-o",
              "direct.pfm");
    struct cranny_image depth = read_image("frame-depth.exr", CRANNY_IMAGE_DEPTH);
    test_conventions(&depth);
    test_normals();
    test_viewport();
    test_usage();
    test_broken(&depth);
    test_doctor(&depth);
    test_advice();
    test_one_pixel();
    cranny_image_free(&depth);
    char left[4096];
    list_folder(left, sizeof left);
    CHECK_MSG(strcmp(left, "/./../direct.pfm/frame-depth.exr/frame-normal.exr/frame.json/"
                           "view.gltf") == 0,
              "left behind: %s", left);
    clear_folder();
    CHECK(chdir("..") == 0 && rmdir(folder) == 0);
    return check_end("render_depth");
}
