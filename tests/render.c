/* cranny render of scenes from outside: options, pictures, JSON, files left behind. */
#include "render_files.h"

static const char *const methods[] = {"ssao", "hbao", "crease", "alchemy", "raymarch", "volumes"};
enum { METHOD_COUNT = sizeof methods / sizeof *methods, SEES_ALL = METHOD_COUNT - 1 };

/* Each with the words its line must hold; all are refused before anything is drawn. */
static void test_usage(void)
{
    static const struct {
        const char *part, *arguments[8];
    } cases[] = {
        {"ssao, hbao, crease, alchemy, volumes, raymarch, raytrace", {"--method", "sao"}},
        {"cranny render --method hbao --help", {"--method", "hbao", "--thickness=1"}},
        {"render --method raytrace --help", {"--method=raytrace", "--cpu-mask", "avx2"}},
        {"auto, portable, avx2, avx512", {"--cpu-mask", "sse"}},
        {"render --method volumes --help", {"--method", "volumes", "--samples", "8"}},
        {"--spacing: 17 is out of range", {"--method", "volumes", "--spacing", "17"}},
        {"front, material, both", {"--method", "volumes", "--faces", "back"}},
        {"--radius: 0 is out of range", {"--radius", "0"}},
        {"--radius-world: -1 is out of range", {"--radius-world=-1"}},
        {"did you mean '--radius'", {"--raduis", "1"}},
        {"'--samples'", {"--set", "sampels=2"}},
        {"none of: calibrated, paper", {"--preset", "papr"}},
        {"--bits: '9'", {"--bits", "9"}},
        {"--bits 16 is not for .pfm", {"--bits", "16", "-o", "a.pfm"}},
        {"--lit picture has 8", {"--bits", "16", "--lit"}},
        {"--lit takes a name that ends in .png", {"--lit", "-o", "a.pfm"}},
        {"--exposure goes with --lit", {"--exposure", "2"}},
        {".png or .pfm or .exr", {"-o", "a.jpg"}},
        {"WIDTHxHEIGHT", {"--size", "0x4"}},
        {"--size", {"--size", "16385x4"}},
        {"--eye: '1,2' is not X,Y,Z", {"--eye", "1,2"}},
        {"--eye: '1,2,inf'", {"--eye", "1,2,inf"}},
        {"--eye needs --target", {"--eye", "1,2,3"}},
        {"--target needs --eye", {"--target", "1,2,3"}},
        {"--up goes with --eye", {"--up", "0,0,1"}},
        {"give one of them", {"--camera", "0", "--eye", "1,2,3", "--target", "0,0,0"}},
        {"looks nowhere", {"--eye", "1,2,3", "--target", "1,2,3"}},
        {"none of the 2 cameras", {"--camera", "2"}},
        {"--camera: 'side'", {"--camera", "side"}},
        {"--fov and --ortho", {"--fov", "60", "--ortho", "2"}},
        {"--fov: 180 degrees", {"--fov", "180"}},
        {"--fov: '0' is not a number above 0", {"--fov", "0"}},
        {"--ortho: must be finite", {"--ortho", "inf"}},
        {"--msaa", {"--msaa", "3"}},
        {"face, smooth", {"--normals-from", "flat"}},
        {"--guard", {"--guard", "-1"}},
        {"guard band", {"--guard", "8192"}},
        {"--repeat", {"--repeat", "0"}},
        {"--gbuffer: the prefix is empty", {"--gbuffer", ""}},
        {"leave out --msaa", {"--gbuffer", "g", "--msaa", "4"}},
        {"--near goes with --depth", {"--near", "1"}},
        {"--normal goes with --depth", {"--normal", "n.exr"}},
        {"one input at a time", {"--depth", "d.exr"}},
        {"b.gltf", {"b.gltf"}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const char *const *a = cases[i].arguments;
        check_failure(run("render", "view.gltf", a[0], a[1], a[2], a[3], a[4], a[5], a[6], NULL), 2,
                      cases[i].part);
    }
    check_failure(run("render", NULL), 2, "no scene and no --depth given");
    check_failure(run("render", "frame.exr", NULL), 2, "--depth frame.exr");
    check_failure(run("render", "--depth", "d.exr", "--method", "volumes", NULL), 2,
                  "--method volumes needs a scene");
    check_failure(run("render", "nowhere.gltf", NULL), 3, "nowhere.gltf");
    check_failure(run("render", "view.gltf", "--preset", "nowhere.json", NULL), 3, "nowhere.json");
}

static void test_help(void)
{
    struct result result = run("render", "--method", "hbao", "--help", NULL);
    CHECK_EXIT(result, 0);
    CHECK_TEXT(result.out, "--angle-bias");
    CHECK_TEXT(result.out, "also --radius");
    CHECK_TEXT(result.out, "--preset calibrated|paper|FILE.json");
    CHECK(!strstr(result.out, "--thickness"));
    done(&result);
    result = run("render", "--method", "volumes", "--help", NULL);
    CHECK_EXIT(result, 0);
    CHECK_TEXT(result.out, "--delta-scale");
    CHECK_TEXT(result.out, "--preset calibrated|paper|FILE.json");
    done(&result);
    result = run("render", "--help", NULL);
    CHECK_EXIT(result, 0);
    CHECK_TEXT(result.out, "--method hbao --help");
    done(&result);
    result = run("render", "--help", "--method=raytrace", NULL);
    CHECK_EXIT(result, 0);
    CHECK_TEXT(result.out, "--error-target");
    CHECK_TEXT(result.out, "Usage: cranny render --method raytrace SCENE [-o OUT]");
    CHECK(!strstr(result.out, "--preset calibrated"));
    done(&result);
}

static void test_json(void)
{
    static const char *const keys[] = {
        "method",       "preset", "width",   "height",     "device",   "isa",
        "milliseconds", "input",  "output",  "parameters", "warnings", "mean_visibility",
        "guard_band",   "repeat", "seconds", NULL};
    static const char *const stages[] = {"total", "prepare", "estimate", "filter", NULL};
    static const char *const seconds[] = {"load", "bvh", "frame", "write", "total", NULL};
    struct result result = run("render", "view.gltf", "--json", "--size", "80x60", "--radius",
                               "0.25", "--set", "samples=7", "--repeat", "3", NULL);
    json_t *object = take_json(&result, 0);
    check_keys(object, keys);
    check_keys(json_object_get(object, "milliseconds"), stages);
    check_keys(json_object_get(object, "seconds"), seconds);
    CHECK(strcmp(text_of(object, "method"), "alchemy") == 0);
    CHECK(strcmp(text_of(object, "preset"), "calibrated") == 0);
    CHECK(strcmp(text_of(object, "device"), "cpu") == 0);
    CHECK(strcmp(text_of(object, "output"), "view-ao.png") == 0);
    CHECK_INT(number_of(object, "width"), 80);
    CHECK_INT(number_of(object, "guard_band"), 6);
    const double mean = number_of(object, "mean_visibility");
    CHECK_MSG(mean > 0.5 && mean < 0.9999, "mean visibility %g", mean);
    json_t *parameters = json_object_get(object, "parameters");
    CHECK_NEAR(number_of(parameters, "radius_world"), 0.25, 0);
    CHECK_INT(number_of(parameters, "samples"), 7);
    CHECK(json_dump_file(parameters, "preset.json", 0) == 0);
    json_decref(object);
    rename("view-ao.png", "first.png");
    result = run("render", "view.gltf", "-q", "--size", "80x60", "--preset", "preset.json", NULL);
    CHECK_EXIT(result, 0);
    CHECK_INT(result.out_size + result.err_size, 0);
    CHECK(same_files("first.png", "view-ao.png"));
    done(&result);
    unlink("first.png");
    unlink("preset.json");
    unlink("view-ao.png");
}

static void test_raytrace(void)
{
    static const char *const keys[] = {"rays", "rays_per_pixel", "passes", "standard_error", NULL};
    struct result result = run("render", "view.gltf", "--json", "--size", "40x30", "--method",
                               "raytrace", "--rays", "64", "-o", "truth.exr", NULL);
    json_t *object = take_json(&result, 0);
    check_keys(object, keys);
    CHECK_INT(number_of(object, "rays_per_pixel"), 64);
    CHECK_INT(number_of(object, "guard_band"), 0);
    CHECK(json_is_null(json_object_get(object, "isa")));
    const double error = number_of(json_object_get(object, "standard_error"), "mean");
    CHECK_MSG(error > 0 && error < 0.05, "standard error %g", error);
    CHECK_NEAR(number_of(json_object_get(object, "parameters"), "radius_world"), 0.5, 0);
    json_decref(object);
    CHECK_RUN("render", "view.gltf", "--size", "40x30", "--method", "raytrace", "--rays", "64",
              "--threads", "1", "-o", "one.exr");
    CHECK(same_files("truth.exr", "one.exr"));
    unlink("truth.exr");
    unlink("one.exr");
}

/* A preset file that says whose it is is refused by other methods. */
static void check_foreign_preset(void)
{
    CHECK_RUN("render", "view.gltf", "--size", "8x8", "--method", "volumes", "--preset",
              "preset.json", "-o", "one.png");
    check_failure(run("render", "view.gltf", "--size", "8x8", "--preset", "preset.json", "-o",
                      "one.png", NULL),
                  3, "is a preset of 'volumes', not of 'alchemy'");
    unlink("one.png");
}

static void test_volumes(void)
{
    static const char *const keys[] = {"pixels", "refined_pixels", "pairs", "volumes",
                                       "isa",    "milliseconds",   NULL};
    static const char *const stages[] = {"total", "prepare", "estimate", "filter", NULL};
    static const char *const pairs[] = {"candidates", "tested", "evaluated", NULL};
    static const char *const made[] = {"polygons", "quads", "dropped", "bytes", "seconds", NULL};
    struct result result = run("render", "view.gltf", "--json", "--size", "80x60", "--method",
                               "volumes", "--repeat", "3", "-o", "full.pfm", NULL);
    json_t *object = take_json(&result, 0);
    check_keys(object, keys);
    check_keys(json_object_get(object, "milliseconds"), stages);
    check_keys(json_object_get(object, "pairs"), pairs);
    check_keys(json_object_get(object, "volumes"), made);
    CHECK(number_of(json_object_get(object, "volumes"), "polygons") > 0);
    CHECK(number_of(json_object_get(object, "pairs"), "evaluated") > 0);
    CHECK_INT(number_of(object, "guard_band"), 0);
    CHECK(strcmp(text_of(object, "preset"), "calibrated") == 0);
    CHECK(json_dump_file(json_object_get(object, "parameters"), "preset.json", 0) == 0);
    json_decref(object);
    check_foreign_preset();
    CHECK_RUN("render", "view.gltf", "--size", "80x60", "--method", "raytrace", "--rays", "256",
              "-o", "truth.pfm");
    CHECK_MSG(largest_difference("full.pfm", "truth.pfm") < 0.25, "%g from the truth",
              largest_difference("full.pfm", "truth.pfm"));
    CHECK_RUN("render", "view.gltf", "--size", "80x60", "--method", "volumes", "--guard", "9", "-o",
              "other.pfm");
    CHECK(same_files("full.pfm", "other.pfm"));
    CHECK_RUN("render", "view.gltf", "--size", "80x60", "--method", "volumes", "--set", "spacing=5",
              "-o", "other.pfm");
    CHECK(!same_files("full.pfm", "other.pfm"));
    CHECK_MSG(largest_difference("full.pfm", "other.pfm") < 0.5, "%g with one pixel in 25",
              largest_difference("full.pfm", "other.pfm"));
    CHECK_RUN("render", "view.gltf", "--size", "40x30", "--method", "volumes", "--msaa", "4",
              "--lit", "-o", "lit.png");
    static const char *const files[] = {"full.pfm", "truth.pfm", "other.pfm", "lit.png",
                                        "preset.json"};
    for (int i = 0; i < 5; i++)
        CHECK(unlink(files[i]) == 0);
}

static void test_same_bits(void)
{
    static const char *const variants[][2] = {{"--threads", "1"},         {"--threads", "7"},
                                              {"--cpu-mask", "portable"}, {"--isa", "avx2"},
                                              {"--cpu-mask", "avx512"},   {"--repeat", "2"}};
    for (int m = 0; m < METHOD_COUNT; m++) {
        CHECK_RUN("render", "view.gltf", "--size", "75x50", "--bits", "16", "--method", methods[m],
                  "-o", "first.png");
        for (size_t i = 0; i < sizeof variants / sizeof *variants; i++) {
            CHECK_RUN("render", "view.gltf", "--size", "75x50", "--bits", "16", "--method",
                      methods[m], variants[i][0], variants[i][1], "-o", "other.png");
            CHECK_MSG(same_files("first.png", "other.png"), "%s differs with %s %s", methods[m],
                      variants[i][0], variants[i][1]);
        }
    }
    CHECK_RUN("render", "view.gltf", "--size", "75x50", "--preset", "paper", "-o", "other.png");
    CHECK(largest_difference("first.png", "other.png") > 0.05);
    unlink("first.png");
    unlink("other.png");
}

/* What --gbuffer keeps gives the same picture when it is read back by the command it names. */
static void test_gbuffer(void)
{
    CHECK_RUN("render", "view.gltf", "--size", "96x64", "--gbuffer", "it's me", "-o", "a.pfm");
    json_t *object = json_load_file("it's me.json", 0, NULL);
    char line[4096];
    snprintf(line, sizeof line, "'%s' %s -o b.pfm -q >.out 2>.err", COMMAND,
             text_of(object, "command") + strlen("cranny "));
    CHECK_INT(system(line), 0);
    CHECK_MSG(largest_difference("a.pfm", "b.pfm") < 1.0 / 255, "%s: differs by %g", line,
              largest_difference("a.pfm", "b.pfm"));
    CHECK_INT(json_array_size(json_object_get(object, "world_from_view")), 12);
    CHECK_NEAR(number_of(json_object_get(object, "projection"), "fov_degrees"),
               0.8 * 180 / 3.14159265, 1e-4);
    unlink(text_of(object, "depth"));
    unlink(text_of(object, "normal"));
    json_decref(object);
    const char *const made[] = {"it's me.json", "a.pfm", "b.pfm", ".out", ".err"};
    for (int i = 0; i < 5; i++)
        CHECK(unlink(made[i]) == 0);
}

/* Cameras by number, by name and by hand give the picture that they name. */
static void test_cameras(void)
{
    CHECK_RUN("render", "view.gltf", "--size", "64x48", "-o", "first.png");
    CHECK_RUN("render", "view.gltf", "--size", "64x48", "--camera", "front", "-o", "named.png");
    CHECK_RUN("render", "view.gltf", "--size", "64x48", "--eye", "1.2,1.1,5", "--target",
              "1.2,1.1,0", "--fov", "45.8366236", "-o", "given.png");
    CHECK_RUN("render", "view.gltf", "--size", "64x48", "--camera", "1", "-o", "plan.png");
    CHECK_RUN("render", "view.gltf", "--size", "64x48", "--eye", "1.1,0.9,5", "--target",
              "1.1,0.9,0", "--up", "0,2,0", "--ortho", "1.2", "-o", "parallel.png");
    CHECK(same_files("first.png", "named.png"));
    CHECK(!same_files("first.png", "plan.png"));
    CHECK_MSG(largest_difference("first.png", "given.png") < 0.03, "%g",
              largest_difference("first.png", "given.png"));
    CHECK_MSG(largest_difference("plan.png", "parallel.png") < 0.03, "%g",
              largest_difference("plan.png", "parallel.png"));
    const char *const made[] = {"first.png", "named.png", "given.png", "plan.png", "parallel.png"};
    for (int i = 0; i < 5; i++)
        CHECK(unlink(made[i]) == 0);
}

static void check_range(const char *path)
{
    struct cranny_image image = read_image(path, CRANNY_IMAGE_VALUE);
    for (int i = 0; i < image.width * image.height; i++)
        CHECK(image.pixels[i] >= 0 && image.pixels[i] <= 1);
    cranny_image_free(&image);
}

static void test_extremes(void)
{
    static const char *const radii[] = {"1e-9", "1e9"};
    static const char *const words[] = {"little will show", "occluders out of sight"};
    for (int m = 0; m < METHOD_COUNT; m++)
        CHECK_RUN("render", "view.gltf", "--size", "1x1", "--guard", "0", "--method", methods[m],
                  "-o", "one.pfm");
    for (int m = 0; m < METHOD_COUNT; m++)
        for (int i = 0; i < 2; i++) {
            struct result result = run("render", "view.gltf", "--size", "48x32", "--method",
                                       methods[m], "--radius", radii[i], "-o", "one.pfm", NULL);
            CHECK_EXIT(result, 0);
            const bool warns = i == 0 || m < SEES_ALL;
            if (warns)
                CHECK_TEXT(result.err, words[i]);
            CHECK_INT(line_count(result.err), warns);
            check_range("one.pfm");
            done(&result);
        }
    CHECK_RUN("render", "view.gltf", "--size", "33x21", "--msaa", "8", "--normals-from", "smooth",
              "--guard", "3", "-o", "one.pfm");
    check_range("one.pfm");
    CHECK_RUN("render", "view.gltf", "--eye", "9,9,9", "--target", "10,10,10", "--size", "8x8",
              "-o", "one.pfm");
    struct cranny_image sky = read_image("one.pfm", CRANNY_IMAGE_VALUE);
    CHECK(sky.pixels && sky.pixels[0] == 1);
    cranny_image_free(&sky);
    unlink("one.pfm");
}

static void test_pictures(void)
{
    CHECK_RUN("render", "view.gltf", "--size", "64x48", "--lit");
    struct cranny_image lit = read_image("view-lit.png", CRANNY_IMAGE_COLOR);
    CHECK(lit.width == 64 && lit.height == 48 && lit.integers);
    cranny_image_free(&lit);
    CHECK_RUN("render", "view.gltf", "--size", "64x48", "--lit", "--exposure", "1", "-o", "a.png");
    CHECK_RUN("render", "view.gltf", "--size", "64x48", "--lit", "--exposure", "2", "-o", "b.png");
    CHECK(largest_difference("a.png", "b.png") > 0.05);
    CHECK_RUN("render", "view.gltf", "--size", "64x48", "-o", "a.pfm");
    CHECK_RUN("render", "view.gltf", "--size", "64x48", "-o", "a.png");
    CHECK_RUN("render", "view.gltf", "--size", "64x48", "-o", "b.png", "--bits", "16");
    CHECK_NEAR(largest_difference("a.pfm", "a.png"), 0.5 / 255, 0.51 / 255);
    CHECK_NEAR(largest_difference("a.pfm", "b.png"), 0.5 / 65535, 0.51 / 65535);
    struct result result = run("render", "view.gltf", "--size", "64x48", "-o", "c.exr", NULL);
    if (cranny_image_has_exr()) {
        CHECK_EXIT(result, 0);
        CHECK(largest_difference("a.pfm", "c.exr") == 0);
        unlink("c.exr");
        done(&result);
    } else
        check_failure(result, 2, "without OpenEXR");
    const char *const made[] = {"view-lit.png", "a.pfm", "a.png", "b.png"};
    for (int i = 0; i < 4; i++)
        CHECK(unlink(made[i]) == 0);
}

static void check_old_output(const char *before)
{
    char after[4096];
    size_t size;
    list_folder(after, sizeof after);
    CHECK_MSG(strcmp(before, after) == 0, "files before: %s, after: %s", before, after);
    char *old = read_file("view-ao.png", &size);
    CHECK(size == 3 && memcmp(old, "old", 3) == 0);
    free(old);
}

/* The input is no scene: an exit of 1 shows that the folder was tried before anything was read. */
static void test_folders(void)
{
    write_file("junk.glb", "junk", 4);
    check_failure(run("render", "junk.glb", "-o", "no/out.png", NULL), 1, "no/out.png");
    check_failure(run("render", "junk.glb", "--gbuffer", "no/x", NULL), 1, "no/x-depth");
    mkdir("folder.png", 0700);
    check_failure(run("render", "junk.glb", "-o", "folder.png", NULL), 1, "folder.png");
    rmdir("folder.png");
    check_failure(run("render", "junk.glb", NULL), 3, "junk.glb");
    if (geteuid() != 0) {
        mkdir("closed", 0500);
        check_failure(run("render", "junk.glb", "-o", "closed/a.png", NULL), 1, "closed/a.png");
        rmdir("closed");
    }
    unlink("junk.glb");
    char before[4096];
    write_file("view-ao.png", "old", 3);
    list_folder(before, sizeof before);
    check_failure(run_full("render", "view.gltf", "--size", "400x300", "--bits", "16", NULL), 1,
                  "view-ao.png");
    check_old_output(before);
    unlink("view-ao.png");
}

static void test_interrupt(const char *method, const char *option, const char *value)
{
    char before[4096];
    write_file("view-ao.png", "old", 3);
    list_folder(before, sizeof before);
    char *args[] = {(char *)"cranny",  (char *)"render",    (char *)"view.gltf", (char *)"--size",
                    (char *)"320x240", (char *)"--gbuffer", (char *)"frame",     (char *)"--method",
                    (char *)method,    (char *)option,      (char *)value,       NULL};
    check_interrupt(args, 700, "cranny: interrupted; nothing was written");
    check_old_output(before);
    unlink("view-ao.png");
}

int main(void)
{
    char folder[] = "render-XXXXXX";
    CHECK(mkdtemp(folder) && chdir(folder) == 0);
    write_scene("view.gltf");
    test_usage();
    test_help();
    test_json();
    test_raytrace();
    test_volumes();
    test_same_bits();
    test_gbuffer();
    test_cameras();
    test_extremes();
    test_pictures();
    test_folders();
    test_interrupt("raytrace", "--rays", "65536");
    test_interrupt("raymarch", "--repeat", "10000");
    test_interrupt("volumes", "--repeat", "10000");
    char left[4096];
    list_folder(left, sizeof left);
    CHECK_MSG(strcmp(left, "/./../view.gltf") == 0, "left behind: %s", left);
    clear_folder();
    CHECK(chdir("..") == 0 && rmdir(folder) == 0);
    return check_end("render");
}
