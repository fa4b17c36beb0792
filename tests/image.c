/* Float images in PNG and PFM: there and back, exactness, hostile files, refusals. */
#include "image_files.h"

#include "base/image_channels.h"

#include <png.h>

#define PATH_PNG "image-test.png"
#define PATH_PFM "image-test.pfm"

static const float specials[12] = {0,     1,         -1,  0.5f,     1e-40f,  -0.f,
                                   3e38f, -INFINITY, NAN, INFINITY, 1.f / 3, -7.25f};

static void test_pfm_round_trip(void)
{
    struct cranny_error why;
    struct cranny_image image;
    for (int channels = 1; channels <= 3; channels += 2) {
        enum cranny_image_kind kind = channels == 3 ? CRANNY_IMAGE_NORMAL : CRANNY_IMAGE_DEPTH;
        CHECK_OK(cranny_image_write(PATH_PFM, kind, CRANNY_IMAGE_AUTO, 12 / channels / 2, 2,
                                    channels, specials, 0, &why),
                 why);
        CHECK_OK(cranny_image_read(PATH_PFM, kind, &image, &why), why);
        CHECK_INT(image.width, 12 / channels / 2);
        CHECK_INT(image.height, 2);
        CHECK_INT(image.channels, channels);
        CHECK(!image.integers);
        CHECK(image.pixels && same_bits(image.pixels, specials, 12));
        cranny_image_free(&image);
        CHECK(!image.pixels);
    }
    cranny_image_free(&image);
}

static void test_pfm_bytes(void)
{
    static const char big[] = "Pf\n1 2\n1.0\n\x3f\x80\0\0\x40\0\0\0";
    static const char little[] = "Pf 1\t2 -0.5\r\0\0\x80\x3f\0\0\0\x40\n";
    static const char color[] = "PF\n1 1\n+1e0\n\x3f\x80\0\0\x40\0\0\0\x40\x40\0\0";
    struct cranny_error why;
    struct cranny_image image;
    CHECK_OK(decode_cut((const uint8_t *)big, sizeof big - 1, CRANNY_IMAGE_VALUE, 9, &image, &why),
             why);
    CHECK(image.pixels && image.pixels[0] == 2 && image.pixels[1] == 1);
    cranny_image_free(&image);
    CHECK_OK(
        decode_cut((const uint8_t *)little, sizeof little - 1, CRANNY_IMAGE_COLOR, 9, &image, &why),
        why);
    CHECK(image.channels == 3 && image.pixels[0] == 2 && image.pixels[2] == 2 &&
          image.pixels[3] == 1);
    cranny_image_free(&image);
    CHECK_OK(
        decode_cut((const uint8_t *)color, sizeof color - 1, CRANNY_IMAGE_NORMAL, 9, &image, &why),
        why);
    CHECK(image.channels == 3 && image.pixels[0] == 1 && image.pixels[1] == 2 &&
          image.pixels[2] == 3);
    cranny_image_free(&image);
    check_cuts((const uint8_t *)big, sizeof big - 1, CRANNY_IMAGE_VALUE);
    check_flips((const uint8_t *)color, sizeof color - 1, CRANNY_IMAGE_COLOR);
}

static void test_pfm_refused(void)
{
    static const char *const headers[] = {
        "Pf\n1 2\n0\nabcdefgh",
        "Pf\n1 2\n-0.00\nabcdefgh",
        "Pf\n-1 2\n1\nabcdefgh",
        "Pf\n1 2x\n1\nabcdefgh",
        "Pf\n1 2\nnan\nabcdefgh",
        "PF\n1 2\n1\nabcdefgh",
        "Pf\n2 2\n1\nabcdefgh",
        "Pf\n1 1\n1\nabcdefgh",
        "Pf\n99999999999 1\n1\nabcd",
        "Pf",
        "PfPf 1 1 1 abcd",
        "Pf\n999999999 999999999\n1\nabcd",
    };
    for (size_t i = 0; i < COUNT_OF(headers); i++)
        check_refused(headers[i], strlen(headers[i]), CRANNY_IMAGE_VALUE, CRANNY_INPUT, "PFM");
    check_refused("Pf\n0 2\n1\n\n", 10, CRANNY_IMAGE_VALUE, CRANNY_INPUT, "0 x 2");
    check_refused("Pf\n1 1\n1\nabcd", 13, CRANNY_IMAGE_NORMAL, CRANNY_INPUT, "normals");
    check_refused("", 0, CRANNY_IMAGE_VALUE, CRANNY_INPUT, "empty");
    check_refused("GIF89a", 6, CRANNY_IMAGE_VALUE, CRANNY_INPUT, "PNG");
    uint8_t *wide = calloc(1, 70000);
    int length = snprintf((char *)wide, 70000, "Pf\n16385 1\n1\n");
    check_refused(wide, (size_t)length + 16385 * 4, CRANNY_IMAGE_VALUE, CRANNY_INPUT, "16384");
    free(wide);
    struct cranny_error why;
    struct cranny_image image;
    CHECK_INT(decode_cut((const uint8_t *)"Pf\n1 2\n1\nabcdefgh", 17, CRANNY_IMAGE_VALUE, 1, &image,
                         &why),
              CRANNY_MEMORY);
}

/* Every one of a PNG's steps comes back as itself and is written as itself. */
static void test_png_exact(enum cranny_image_bits bits, int most)
{
    struct cranny_error why;
    struct cranny_image image;
    const int side = bits == CRANNY_IMAGE_BITS16 ? 256 : 16;
    float *steps = calloc((size_t)side * side, sizeof *steps);
    for (int i = 0; i <= most; i++)
        steps[i] = (float)i / (float)most;
    CHECK_OK(cranny_image_write(PATH_PNG, CRANNY_IMAGE_VALUE, bits, side, side, 1, steps, 0, &why),
             why);
    CHECK_OK(cranny_image_read(PATH_PNG, CRANNY_IMAGE_VALUE, &image, &why), why);
    CHECK(image.integers && image.width == side && image.height == side && image.channels == 1);
    CHECK(same_bits(image.pixels, steps, (size_t)side * side));
    cranny_image_free(&image);
    free(steps);
}

static void test_png_rounding(void)
{
    const float values[8] = {NAN, -INFINITY, INFINITY, 2, 0.4999f / 255, 0.5001f / 255, -1, 0.5f};
    const float expected[8] = {0, 0, 1, 1, 0, 1.f / 255, 0, 128.f / 255};
    struct cranny_error why;
    struct cranny_image image;
    CHECK_OK(cranny_image_write(PATH_PNG, CRANNY_IMAGE_VALUE, CRANNY_IMAGE_AUTO, 4, 2, 1, values, 0,
                                &why),
             why);
    CHECK_OK(cranny_image_read(PATH_PNG, CRANNY_IMAGE_VALUE, &image, &why), why);
    for (int i = 0; i < 8; i++)
        CHECK_NEAR(image.pixels[i], expected[i], 0);
    cranny_image_free(&image);
}

static void test_png_stride(void)
{
    const float padded[2][8] = {{0, 0.2f, 0.4f, 1, 1, 1, 7, 7}, {1, 0, 0, 0, 1, 0, 7, 7}};
    struct cranny_error why;
    struct cranny_image image;
    CHECK_OK(cranny_image_write(PATH_PNG, CRANNY_IMAGE_COLOR, CRANNY_IMAGE_BITS16, 2, 2, 3,
                                padded[0], sizeof padded[0], &why),
             why);
    CHECK_OK(cranny_image_read(PATH_PNG, CRANNY_IMAGE_COLOR, &image, &why), why);
    for (int y = 0; y < 2; y++)
        for (int i = 0; i < 6; i++)
            CHECK_NEAR(image.pixels[y * 6 + i], padded[y][i], 0.5 / 65535);
    cranny_image_free(&image);
    CHECK_OK(cranny_image_read(PATH_PNG, CRANNY_IMAGE_VALUE, &image, &why), why);
    CHECK(image.channels == 1 && image.pixels[0] == 0 && image.pixels[1] == 1 &&
          image.pixels[2] == 1);
    cranny_image_free(&image);
}

struct png_text {
    uint8_t data[65536];
    size_t size;
};

static void put_png(png_structp png, png_bytep data, size_t size)
{
    struct png_text *text = png_get_io_ptr(png);
    memcpy(text->data + text->size, data, size);
    text->size += size;
}

/* A file as another program writes it: any type, depth and interlacing, with a gamma and a tRNS
 * that must not matter. */
static void make_png(struct png_text *text, int type, int bits, int interlace, const uint8_t *rows,
                     int width, int height, size_t row_bytes)
{
    const png_color palette[4] = {{10, 20, 30}, {40, 50, 60}, {70, 80, 90}, {100, 110, 120}};
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png_create_info_struct(png);
    text->size = 0;
    png_set_write_fn(png, text, put_png, NULL);
    png_set_IHDR(png, info, (png_uint_32)width, (png_uint_32)height, bits, type, interlace, 0, 0);
    png_set_gAMA(png, info, 0.45455);
    if (type == PNG_COLOR_TYPE_PALETTE)
        png_set_PLTE(png, info, palette, 4);
    if (type == PNG_COLOR_TYPE_GRAY)
        png_set_tRNS(png, info, NULL, 0, &(png_color_16){.gray = 1});
    png_write_info(png, info);
    const int passes = png_set_interlace_handling(png);
    for (int pass = 0; pass < passes; pass++)
        for (int y = 0; y < height; y++)
            png_write_row(png, rows + (size_t)y * row_bytes);
    png_write_end(png, NULL);
    png_destroy_write_struct(&png, &info);
}

static void check_pixels(const struct png_text *text, enum cranny_image_kind kind,
                         const float *expected, int count)
{
    struct cranny_error why;
    struct cranny_image image;
    CHECK_OK(decode_cut(text->data, text->size, kind, PIXELS_ENOUGH, &image, &why), why);
    for (int i = 0; i < count && image.pixels; i++)
        CHECK_NEAR(image.pixels[i], expected[i], 0);
    cranny_image_free(&image);
    check_cuts(text->data, text->size, kind);
    check_flips(text->data, text->size, kind);
}

static void test_png_types(void)
{
    static struct png_text text;
    const uint8_t ramp16[8] = {0x12, 0x34, 0x00, 0x01, 0xff, 0xfe, 0x80, 0x00};
    const float ramp[4] = {0x1234 / 65535.f, 1 / 65535.f, 0xfffe / 65535.f, 0x8000 / 65535.f};
    const uint8_t grey_alpha[8] = {51, 0, 102, 255, 0, 9, 255, 0};
    const float greys[4] = {51 / 255.f, 102 / 255.f, 0, 1};
    const uint8_t bit[2] = {0x80, 0x40}, indices[2] = {0x10, 0xb0};
    const float black_white[4] = {1, 0, 0, 1};
    const float colors[12] = {10 / 255.f, 20 / 255.f,  30 / 255.f,  40 / 255.f,
                              50 / 255.f, 60 / 255.f,  70 / 255.f,  80 / 255.f,
                              90 / 255.f, 100 / 255.f, 110 / 255.f, 120 / 255.f};
    for (int interlace = 0; interlace < 2; interlace++) {
        make_png(&text, PNG_COLOR_TYPE_GRAY, 16, interlace, ramp16, 2, 2, 4);
        check_pixels(&text, CRANNY_IMAGE_VALUE, ramp, 4);
        make_png(&text, PNG_COLOR_TYPE_GRAY_ALPHA, 8, interlace, grey_alpha, 2, 2, 4);
        check_pixels(&text, CRANNY_IMAGE_DEPTH, greys, 4);
        make_png(&text, PNG_COLOR_TYPE_GRAY, 1, interlace, bit, 2, 2, 1);
        check_pixels(&text, CRANNY_IMAGE_VALUE, black_white, 4);
        make_png(&text, PNG_COLOR_TYPE_PALETTE, 2, interlace, indices, 2, 2, 1);
        check_pixels(&text, CRANNY_IMAGE_COLOR, colors, 12);
    }
}

static void test_png_large(void)
{
    enum { WIDTH = 9, HEIGHT = 11 };
    static struct png_text text;
    uint8_t rgba[HEIGHT * WIDTH * 4];
    float expected[HEIGHT * WIDTH * 3];
    for (int i = 0; i < HEIGHT * WIDTH * 4; i++)
        rgba[i] = (uint8_t)(i * 37 + i / 7);
    for (int i = 0; i < HEIGHT * WIDTH * 3; i++)
        expected[i] = (float)rgba[i / 3 * 4 + i % 3] / 255.f;
    for (int interlace = 0; interlace < 2; interlace++) {
        make_png(&text, PNG_COLOR_TYPE_RGB_ALPHA, 8, interlace, rgba, WIDTH, HEIGHT, WIDTH * 4);
        check_pixels(&text, CRANNY_IMAGE_COLOR, expected, HEIGHT * WIDTH * 3);
    }
}

/* What a header says is not allocated before it can be true. */
static void test_png_lies(void)
{
    static struct png_text text;
    const uint8_t grey[2] = {1, 2};
    make_png(&text, PNG_COLOR_TYPE_GRAY, 8, 0, grey, 1, 2, 1);
    struct {
        uint32_t width, height;
        const char *part;
    } lies[] = {{16000, 16000, "broken PNG"}, {0x7fffffff, 0x7fffffff, "broken PNG"},
                {0, 1, "broken PNG"},         {1, 3, "broken PNG"},
                {20000, 1, "16384"},          {1, 1u << 31, "broken PNG"}};
    for (size_t i = 0; i < COUNT_OF(lies); i++) {
        png_save_uint_32(text.data + 16, lies[i].width);
        png_save_uint_32(text.data + 20, lies[i].height);
        uint32_t crc = 0xffffffff;
        for (int b = 12; b < 29; b++) {
            crc ^= text.data[b];
            for (int k = 0; k < 8; k++)
                crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0);
        }
        png_save_uint_32(text.data + 29, ~crc);
        check_refused(text.data, text.size, CRANNY_IMAGE_VALUE, CRANNY_INPUT, lies[i].part);
    }
}

static void check_write(enum cranny_status expected, const char *path, enum cranny_image_kind kind,
                        enum cranny_image_bits bits, int width, int channels, size_t stride)
{
    struct cranny_error why = {0};
    enum cranny_status status =
        cranny_image_write(path, kind, bits, width, 1, channels, specials, stride, &why);
    CHECK_MSG(status == expected && *why.message && strstr(why.message, path), "%s: status %s: %s",
              path, cranny_status_name(status), why.message);
}

static void test_write_refused(void)
{
    const enum cranny_image_kind value = CRANNY_IMAGE_VALUE;
    check_write(CRANNY_USAGE, "a.jpg", value, CRANNY_IMAGE_AUTO, 1, 1, 0);
    check_write(CRANNY_USAGE, "png", value, CRANNY_IMAGE_AUTO, 1, 1, 0);
    check_write(CRANNY_USAGE, "a.png/b", value, CRANNY_IMAGE_AUTO, 1, 1, 0);
    check_write(CRANNY_USAGE, "a.pfm", value, CRANNY_IMAGE_BITS16, 1, 1, 0);
    check_write(CRANNY_USAGE, "a.exr", value, CRANNY_IMAGE_BITS8, 1, 1, 0);
    check_write(CRANNY_USAGE, "a.png", value, CRANNY_IMAGE_AUTO, 0, 1, 0);
    check_write(CRANNY_USAGE, "a.png", value, CRANNY_IMAGE_AUTO, 16385, 1, 0);
    check_write(CRANNY_USAGE, "a.png", value, CRANNY_IMAGE_AUTO, 1, 2, 0);
    check_write(CRANNY_USAGE, "a.png", CRANNY_IMAGE_DEPTH, CRANNY_IMAGE_AUTO, 1, 3, 0);
    check_write(CRANNY_USAGE, "a.png", CRANNY_IMAGE_NORMAL, CRANNY_IMAGE_AUTO, 1, 1, 0);
    check_write(CRANNY_USAGE, "a.png", value, CRANNY_IMAGE_AUTO, 2, 1, 4);
    check_write(CRANNY_USAGE, "a.png", value, CRANNY_IMAGE_AUTO, 2, 1, 9);
    check_write(CRANNY_FAILED, "no/such/a.pfm", value, CRANNY_IMAGE_AUTO, 1, 1, 0);
    CHECK(access("a.png", F_OK) != 0 && access("a.pfm", F_OK) != 0);
    struct cranny_error why;
    struct cranny_image image;
    CHECK_INT(cranny_image_read("no-such.png", value, &image, &why), CRANNY_INPUT);
    CHECK(strstr(why.message, "no-such.png") && !image.pixels);
    CHECK_INT(cranny_image_read(".", value, &image, &why), CRANNY_INPUT);
    if (!cranny_image_has_exr()) {
        check_write(CRANNY_USAGE, "a.exr", value, CRANNY_IMAGE_AUTO, 1, 1, 0);
        check_refused("\x76\x2f\x31\x01", 4, value, CRANNY_INPUT, "OpenEXR");
    }
}

/* `names`: separated by spaces; `expected`: the chosen ones. */
static void check_choice(enum cranny_image_kind kind, const char *names, const char *expected)
{
    char text[256], chosen[256] = "";
    const char *list[16];
    int count = 0;
    snprintf(text, sizeof text, "%s", names);
    for (char *name = strtok(text, " "); name; name = strtok(NULL, " "))
        list[count++] = name;
    struct channel_choice choice = channels_choose(kind, list, count);
    for (int i = 0; i < choice.count; i++)
        snprintf(chosen + strlen(chosen), sizeof chosen - strlen(chosen), "%s%s", i ? " " : "",
                 list[choice.index[i]]);
    CHECK_MSG(strcmp(chosen, expected) == 0, "of %s: '%s', expected '%s'", names, chosen, expected);
}

static void test_channels(void)
{
    check_choice(CRANNY_IMAGE_VALUE, "A B G R Y", "Y");
    check_choice(CRANNY_IMAGE_VALUE, "A B G R V", "V");
    check_choice(CRANNY_IMAGE_VALUE, "A B G R", "R");
    check_choice(CRANNY_IMAGE_VALUE, "AO", "AO");
    check_choice(CRANNY_IMAGE_VALUE, "AO.B AO.G AO.R", "AO.R");
    check_choice(CRANNY_IMAGE_VALUE, "foo bar", "");
    check_choice(CRANNY_IMAGE_VALUE, "a.R b.R", "");
    check_choice(CRANNY_IMAGE_DEPTH, "B G R Z", "Z");
    check_choice(CRANNY_IMAGE_DEPTH, "N.X N.Y N.Z depth.Z", "depth.Z");
    check_choice(CRANNY_IMAGE_DEPTH, "View.Combined.R View.Depth.V", "View.Depth.V");
    check_choice(CRANNY_IMAGE_DEPTH, "View.Combined.R View.Depth.Z", "View.Depth.Z");
    check_choice(CRANNY_IMAGE_DEPTH, "B Depth G R", "Depth");
    check_choice(CRANNY_IMAGE_DEPTH, "N.X N.Y N.Z", "");
    check_choice(CRANNY_IMAGE_DEPTH, "B G R", "R");
    check_choice(CRANNY_IMAGE_VALUE, "X Y Z", "");
    check_choice(CRANNY_IMAGE_NORMAL, "B G N.X N.Y N.Z R", "N.X N.Y N.Z");
    check_choice(CRANNY_IMAGE_NORMAL, "B G R View.Normal.X View.Normal.Y View.Normal.Z",
                 "View.Normal.X View.Normal.Y View.Normal.Z");
    check_choice(CRANNY_IMAGE_NORMAL, "normal.B normal.G normal.R", "normal.R normal.G normal.B");
    check_choice(CRANNY_IMAGE_NORMAL, "X Y Z", "X Y Z");
    check_choice(CRANNY_IMAGE_NORMAL, "NX NY NZ Z", "NX NY NZ");
    check_choice(CRANNY_IMAGE_NORMAL, "B G R Z", "R G B");
    check_choice(CRANNY_IMAGE_NORMAL, "Y Z", "");
    check_choice(CRANNY_IMAGE_NORMAL, "", "");
    check_choice(CRANNY_IMAGE_COLOR, "A B G R", "R G B");
    check_choice(CRANNY_IMAGE_COLOR, "A Y", "Y");
    check_choice(CRANNY_IMAGE_COLOR, "x.B x.G x.R", "x.R x.G x.B");
}

int main(void)
{
    char folder[] = "image-XXXXXX";
    CHECK(mkdtemp(folder) && chdir(folder) == 0);
    test_pfm_round_trip();
    test_pfm_bytes();
    test_pfm_refused();
    test_png_exact(CRANNY_IMAGE_BITS8, 255);
    test_png_exact(CRANNY_IMAGE_BITS16, 65535);
    test_png_rounding();
    test_png_stride();
    test_png_types();
    test_png_large();
    test_png_lies();
    test_write_refused();
    test_channels();
    unlink(PATH_PNG);
    unlink(PATH_PFM);
    CHECK(chdir("..") == 0 && rmdir(folder) == 0);
    return check_end("image");
}
