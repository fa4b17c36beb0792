/* Base colour textures, from a file's image to a frame's picture. */
#include "frame_scenes.h"
#include "gltf_text.h"

#include "base/image.h"

enum { WIDE = 1030, SIDE = 16 };

/* A quad in the plane y = 0 from −1 to 1, u along x, v along z; and an image of which the left half
 * is red, the right one is green, with alpha 255 and 0 at the two ends of `alpha`. */
static void put_quad(struct bytes *bytes, const uint8_t alpha[2], size_t *png_size)
{
    static const float positions[4][3] = {{-1, 0, -1}, {1, 0, -1}, {-1, 0, 1}, {1, 0, 1}};
    static const float texcoords[4][2] = {{0, 0}, {1, 0}, {0, 1}, {1, 1}};
    static const uint16_t corners[6] = {0, 2, 1, 1, 2, 3};
    static uint8_t texels[2][WIDE][4];
    struct cranny_error why;
    uint8_t *png;
    for (int y = 0; y < 2; y++)
        for (int x = 0; x < WIDE; x++) {
            const bool left = x < WIDE / 2;
            memcpy(texels[y][x], (uint8_t[4]){left ? 255 : 0, left ? 0 : 128, 64, alpha[!left]}, 4);
        }
    CHECK_OK(png_encode(WIDE, 2, 4, texels[0][0], sizeof texels[0], &png, png_size, &why), why);
    bytes_put(bytes, positions, sizeof positions);
    bytes_put(bytes, texcoords, sizeof texcoords);
    bytes_put(bytes, corners, sizeof corners);
    bytes_put(bytes, png, *png_size);
    free(png);
}

static struct cranny_scene *load(const char *material, const uint8_t alpha[2], bool colors)
{
    static const char form[] =
        "'bufferViews':[{'buffer':0,'byteLength':48},{'buffer':0,'byteOffset':48,'byteLength':32},"
        "{'buffer':0,'byteOffset':80,'byteLength':12},{'buffer':0,'byteOffset':92,'byteLength':%zu}"
        "],'accessors':[{'bufferView':0,'componentType':5126,'count':4,'type':'VEC3',"
        "'min':[-1,0,-1],'max':[1,0,1]},{'bufferView':1,'componentType':5126,'count':4,"
        "'type':'VEC2'},{'bufferView':2,'componentType':5123,'count':6,'type':'SCALAR'}],"
        "'images':[{'bufferView':3,'mimeType':'image/png'}],"
        "'samplers':[{'wrapS':33071,'wrapT':33071}],'textures':[{'source':0,'sampler':0}],"
        "'materials':[%s],'meshes':[{'primitives':[{'attributes':{'POSITION':0,'TEXCOORD_0':1},"
        "'indices':2,'material':0}]}],'nodes':[{'mesh':0}],'scenes':[{'nodes':[0]}]";
    struct cranny_scene_load_params params = cranny_scene_load_params_default();
    struct cranny_scene *scene = NULL;
    struct cranny_error why;
    static struct bytes bytes;
    size_t png_size;
    char rest[4096];
    bytes.size = 0;
    put_quad(&bytes, alpha, &png_size);
    snprintf(rest, sizeof rest, form, png_size, material);
    char *text = gltf_text(&bytes, rest);
    params.colors = colors;
    CHECK_OK(cranny_scene_load_memory(text, strlen(text), "test.gltf", &params, &scene, &why), why);
    free(text);
    return scene;
}

/* The middle row of a picture from above, in the light of a grey sky. */
static void picture(struct cranny_scene *scene, uint8_t row[SIDE][3])
{
    struct cranny_error why;
    struct stage stage = {
        .scene = scene, .tracer = new_tracer(scene), .camera = look_down(0, 2, 0, 1)};
    const struct cranny_frame_params size = frame_size(SIDE, SIDE);
    struct cranny_frame *frame = draw(&stage, &size);
    struct cranny_light light = {.sky = {1, 1, 1}, .exposure = 1};
    static uint8_t rgb[SIDE][SIDE][3];
    CHECK_OK(cranny_frame_shade(frame, NULL, 0, &light, 0, rgb[0][0], &why), why);
    memcpy(row, rgb[SIDE / 2], sizeof rgb[0]);
    cranny_frame_destroy(&frame);
    leave(&stage);
}

static void check_color(const uint8_t color[3], int red, int green, int blue)
{
    CHECK_MSG(abs(color[0] - red) <= 1 && abs(color[1] - green) <= 1 && abs(color[2] - blue) <= 1,
              "%d %d %d, not %d %d %d", color[0], color[1], color[2], red, green, blue);
}

static const char plain[] = "{'pbrMetallicRoughness':{'baseColorTexture':{'index':0}}}";
static const uint8_t opaque[2] = {255, 255}, holed[2] = {255, 0};

static void test_plain(void)
{
    uint8_t row[SIDE][3];
    struct cranny_scene *scene = load(plain, opaque, false);
    CHECK_INT(cranny_scene_color_texture_count(scene), 0);
    CHECK_INT(cranny_scene_material(scene, 0)->color_texture, -1);
    CHECK(!cranny_scene_mesh(scene, 0)->texcoords);
    picture(scene, row);
    check_color(row[2], 255, 255, 255);
    scene = load(plain, opaque, true);
    CHECK_INT(cranny_scene_color_texture_count(scene), 1);
    const struct cranny_color_texture *texture = cranny_scene_color_texture(scene, 0);
    CHECK_INT(texture->width, (WIDE + 2) / 3);
    CHECK_INT(texture->height, 1);
    CHECK_INT(texture->wrap_u, CRANNY_WRAP_CLAMP);
    CHECK_INT(cranny_scene_material(scene, 0)->alpha_texture, -1);
    picture(scene, row);
    check_color(row[2], 255, 0, 64);
    check_color(row[SIDE - 2], 0, 128, 64);
}

/* The texture times the factor, turned by its transform: left and right change places. */
static void test_factor_and_transform(void)
{
    uint8_t row[SIDE][3];
    picture(load("{'pbrMetallicRoughness':{'baseColorFactor':[1,0.21404,0,1],'baseColorTexture':{"
                 "'index':0,'extensions':{'KHR_texture_transform':{'offset':[1,0],"
                 "'scale':[-1,1]}}}}}",
                 opaque, true),
            row);
    check_color(row[2], 0, 61, 0); /* 0.21404 × linear 128 / 255, encoded */
    check_color(row[SIDE - 2], 255, 0, 0);
}

/* A masked material has both: its holes show the sky, the rest its colour. */
static void test_masked(void)
{
    uint8_t row[SIDE][3];
    struct cranny_scene *scene =
        load("{'alphaMode':'MASK','pbrMetallicRoughness':{'baseColorTexture':{'index':0}}}", holed,
             true);
    CHECK_INT(cranny_scene_material(scene, 0)->alpha_texture, 0);
    CHECK_INT(cranny_scene_material(scene, 0)->color_texture, 0);
    picture(scene, row);
    check_color(row[2], 255, 0, 64);
    CHECK(row[SIDE - 2][0] > 128);
    /* An opaque material's image may have alpha: it is ignored. */
    scene = load(plain, holed, true);
    CHECK_INT(cranny_scene_material(scene, 0)->alpha_texture, -1);
    picture(scene, row);
    check_color(row[SIDE - 2], 0, 128, 64);
}

int main(void)
{
    test_plain();
    test_factor_and_transform();
    test_masked();
    return check_end("colors");
}
