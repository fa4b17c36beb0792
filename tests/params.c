/* Parameter tables: parsing, ranges, round trips, presets. */
#include "check.h"

#include <cranny/base.h>
#include <unistd.h>

struct sample {
    float radius, height, gap;
    int rays, kind;
    bool ground;
};

static const char *const kinds[] = {"red", "green", NULL};
static const struct cranny_param rows[] = {
    {"radius", CRANNY_PARAM_FLOAT, offsetof(struct sample, radius), "m", 0, 10, 0.3, NULL, "", 0},
    {"height", CRANNY_PARAM_FLOAT, offsetof(struct sample, height), "m", -5, 5, NAN, NULL, "", 0},
    {"gap", CRANNY_PARAM_FLOAT, offsetof(struct sample, gap), "m", 1e-9, 0.7, 0.1, NULL, "", 0},
    {"rays", CRANNY_PARAM_INT, offsetof(struct sample, rays), "", 1, 100, 64, NULL, "", 0},
    {"kind", CRANNY_PARAM_ENUM, offsetof(struct sample, kind), "", 0, 1, 1, kinds, "", 0},
    {"ground", CRANNY_PARAM_BOOL, offsetof(struct sample, ground), "", 0, 1, 1, NULL, "", 0},
};
static const struct cranny_param_table table = {"sample", rows, 6};

static void test_round_trip(void)
{
    struct sample s;
    struct cranny_error why;
    char text[64];
    cranny_params_defaults(&table, &s);
    CHECK_NEAR(s.radius, 0.3, 1e-7);
    CHECK(isnan(s.height) && s.rays == 64 && s.kind == 1 && s.ground);
    CHECK_OK(cranny_params_set(&table, &s, "radius", "0.1", &why), why);
    cranny_params_get(&table, &s, "radius", text, sizeof text);
    CHECK_MSG(strcmp(text, "0.1") == 0, "'%s'", text);
    CHECK_OK(cranny_params_set(&table, &s, "kind", "red", &why), why);
    cranny_params_get(&table, &s, "kind", text, sizeof text);
    CHECK(strcmp(text, "red") == 0);
    CHECK_OK(cranny_params_validate(&table, &s, &why), why);
    CHECK_OK(cranny_params_set(&table, &s, "gap", "1e-9", &why), why);
    CHECK_OK(cranny_params_validate(&table, &s, &why), why);
    CHECK_OK(cranny_params_set(&table, &s, "gap", "0.7", &why), why);
    CHECK_OK(cranny_params_validate(&table, &s, &why), why);
}

static void test_refusals(void)
{
    static const char *const bad[][2] = {
        {"radius", "11"}, {"radius", "nan"},   {"radius", "1m"}, {"rays", "0"},  {"rays", "1.5"},
        {"kind", "blue"}, {"ground", "maybe"}, {"colour", "1"},  {"radius", ""}, {"radius", "inf"}};
    struct sample s;
    cranny_params_defaults(&table, &s);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct cranny_error why = {0};
        CHECK_MSG(cranny_params_set(&table, &s, bad[i][0], bad[i][1], &why) == CRANNY_USAGE,
                  "%s=%s", bad[i][0], bad[i][1]);
        CHECK(strstr(why.message, bad[i][0]) != NULL);
    }
    CHECK(s.rays == 64 && s.kind == 1);
    s.rays = 0;
    CHECK_INT(cranny_params_validate(&table, &s, NULL), CRANNY_USAGE);
}

static void test_preset(void)
{
    char path[] = "/tmp/cranny-preset-XXXXXX";
    int file = mkstemp(path);
    const char *json = "{\"radius\": 2.5, \"kind\": \"red\", \"ground\": false, \"height\": null}";
    CHECK(write(file, json, strlen(json)) == (ssize_t)strlen(json));
    close(file);
    struct sample s;
    struct cranny_error why;
    cranny_params_defaults(&table, &s);
    CHECK_OK(cranny_params_load(&table, &s, path, &why), why);
    CHECK(s.radius == 2.5f && s.kind == 0 && !s.ground);
    unlink(path);
    CHECK_INT(cranny_params_load(&table, &s, path, &why), CRANNY_INPUT);
}

/* A file may say which table it is for, and then is for no other. */
static void test_preset_method(void)
{
    static const struct {
        const char *json;
        enum cranny_status status;
    } cases[] = {
        {"{\"method\": \"sample\", \"radius\": 2.5}", CRANNY_OK},
        {"{\"radius\": 2.5, \"method\": \"samples\"}", CRANNY_INPUT},
        {"{\"method\": 7}", CRANNY_INPUT},
        {"{\"method\": null}", CRANNY_INPUT},
    };
    char path[] = "/tmp/cranny-preset-XXXXXX";
    close(mkstemp(path));
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct sample s;
        FILE *file = fopen(path, "w");
        CHECK(file && fputs(cases[i].json, file) >= 0 && fclose(file) == 0);
        cranny_params_defaults(&table, &s);
        CHECK_INT(cranny_params_load(&table, &s, path, NULL), cases[i].status);
    }
    unlink(path);
}

int main(void)
{
    test_round_trip();
    test_refusals();
    test_preset();
    test_preset_method();
    return check_end("params");
}
