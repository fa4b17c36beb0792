/* The occlusion of one polygon: against rays, closed forms, itself in the other form, and at the
 * edges of what numbers can say. `test_volumes N` tries N random polygons. */
#include "check.h"

#include <cranny/volumes.h>

#define PI 3.14159265358979323846
enum { STRATA = 1000, RAYS = STRATA * STRATA, FORMS_TRIED = 100000 };

static uint64_t state = 20091206;

/* (0, 1), by splitmix. */
static double draw(void)
{
    uint64_t x = state += 0x9e3779b97f4a7c15ull;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return ((double)((x ^ (x >> 31)) >> 11) + 0.5) * 0x1p-53;
}

static void draw_direction(double d[3])
{
    const double z = 2 * draw() - 1, angle = 2 * PI * draw(), ring = sqrt(1 - z * z);
    d[0] = ring * cos(angle), d[1] = ring * sin(angle), d[2] = z;
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double c[3])
{
    for (int k = 0; k < 3; k++)
        c[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

/* Corners as seen from the point, which lies at the origin with normal z. */
struct shape {
    double corners[4][3];
    int count;
};

/* A convex polygon in a random plane: corners on an ellipse about `centre`. */
static struct shape draw_shape(const double centre[3], double width, double height)
{
    struct shape s = {.count = draw() < 0.5 ? 3 : 4};
    double u[3], v[3], n[3], angles[4];
    draw_direction(u);
    draw_direction(n);
    cross(n, u, v);
    const double length = sqrt(dot(v, v)) + 1e-12, turn = 2 * PI * draw();
    for (int i = 0; i < s.count; i++)
        angles[i] = turn + 2 * PI * (i + 0.8 * draw()) / s.count;
    for (int i = 0; i < s.count; i++)
        for (int k = 0; k < 3; k++)
            s.corners[i][k] =
                centre[k] + width * cos(angles[i]) * u[k] + height * sin(angles[i]) * v[k] / length;
    return s;
}

/* Above, through and below the tangent plane; tiny, slivers, enormous; near and far. */
static struct shape draw_any(void)
{
    double centre[3];
    const double size = exp(10 * draw() - 5), far = size * exp(4 * draw() - 2);
    draw_direction(centre);
    centre[2] = draw() < 0.7 ? fabs(centre[2]) : centre[2];
    for (int k = 0; k < 3; k++)
        centre[k] *= far;
    const double thin = draw() < 0.2 ? 0.01 : 1;
    return draw_shape(centre, size, size * thin);
}

/* One jittered ray in each of RAYS cells of the disc. */
static float (*cast_rays(void))[3]
{
    float(*rays)[3] = malloc(RAYS * sizeof *rays);
    for (int i = 0; i < RAYS; i++) {
        const double ring = sqrt((i % STRATA + draw()) / STRATA);
        const double angle = 2 * PI * (i / STRATA + draw()) / STRATA;
        rays[i][0] = (float)(ring * cos(angle));
        rays[i][1] = (float)(ring * sin(angle));
        rays[i][2] = (float)sqrt(fmax(0, 1 - ring * ring));
    }
    return rays;
}

/* A ray hits where it lies on the same side of all planes through the point and an edge, and of the
 * polygon. */
static double count_hits(const struct shape *s, const float (*rays)[3])
{
    float planes[4][3];
    double middle[3] = {0};
    for (int i = 0; i < s->count; i++)
        for (int k = 0; k < 3; k++)
            middle[k] += s->corners[i][k];
    for (int i = 0; i < s->count; i++) {
        double plane[3];
        cross(s->corners[i], s->corners[(i + 1) % s->count], plane);
        const double side = dot(plane, middle) < 0 ? -1 : 1, size = sqrt(dot(plane, plane));
        for (int k = 0; k < 3; k++)
            planes[i][k] = (float)(side * plane[k] / (size + 1e-300));
    }
    for (int i = s->count; i < 4; i++)
        memcpy(planes[i], planes[0], sizeof planes[0]);
    long hits = 0;
    for (int r = 0; r < RAYS; r++) {
        const float x = rays[r][0], y = rays[r][1], z = rays[r][2];
        int in = 1;
        for (int i = 0; i < 4; i++)
            in &= planes[i][0] * x + planes[i][1] * y + planes[i][2] * z > 0;
        hits += in;
    }
    return (double)hits / RAYS;
}

/* The same shape somewhere in the world, its point and its normal. */
static struct shape place(const struct shape *s, double scale, double point[3], double normal[3])
{
    struct shape placed = {.count = s->count};
    double axes[3][3], length;
    draw_direction(axes[2]);
    draw_direction(axes[1]);
    cross(axes[1], axes[2], axes[0]);
    length = sqrt(dot(axes[0], axes[0]));
    for (int k = 0; k < 3; k++) {
        axes[0][k] /= length;
        point[k] = scale * (20 * draw() - 10);
        normal[k] = axes[2][k];
    }
    cross(axes[2], axes[0], axes[1]);
    for (int i = 0; i < s->count; i++)
        for (int k = 0; k < 3; k++)
            placed.corners[i][k] =
                point[k] + scale * (s->corners[i][0] * axes[0][k] + s->corners[i][1] * axes[1][k] +
                                    s->corners[i][2] * axes[2][k]);
    return placed;
}

static double occlusion_of(const struct shape *s, const double point[3], const double normal[3],
                           enum cranny_polygon_form form)
{
    return cranny_polygon_occlusion((const double(*)[3])s->corners, s->count, point, normal, form);
}

static void test_against_rays(int shapes)
{
    static const double none[3], up[3] = {0, 0, 1};
    float(*rays)[3] = cast_rays();
    double worst = 0;
    for (int i = 0; i < shapes; i++) {
        const struct shape s = draw_any();
        double point[3], normal[3];
        const struct shape placed = place(&s, exp(8 * draw() - 4), point, normal);
        const double hits = count_hits(&s, (const float(*)[3])rays);
        const double exact = occlusion_of(&s, none, up, CRANNY_FORM_ANGLES);
        const double share = fmax(fmax(hits, exact), 1.0 / RAYS);
        const double tolerance = 4 * sqrt(share * (1 - fmin(share, 0.999999)) / RAYS) + 2.0 / RAYS;
        CHECK_NEAR(exact, hits, tolerance);
        CHECK_NEAR(occlusion_of(&placed, point, normal, CRANNY_FORM_SEGMENTS), exact, 1e-6);
        worst = fmax(worst, fabs(exact - hits) / tolerance);
    }
    printf("%d polygons, %d rays each: at most %.2f standard errors off\n", shapes, RAYS,
           4 * worst);
    free(rays);
}

static void test_forms_agree(void)
{
    double worst = 0;
    for (int i = 0; i < FORMS_TRIED; i++) {
        double point[3], normal[3];
        const struct shape s = draw_any();
        const struct shape placed = place(&s, exp(40 * draw() - 20), point, normal);
        const double a = occlusion_of(&placed, point, normal, CRANNY_FORM_ANGLES);
        const double b = occlusion_of(&placed, point, normal, CRANNY_FORM_SEGMENTS);
        worst = fmax(worst, fabs(a - b));
        if (!(a >= 0 && a <= 1 && fabs(a - b) <= 1e-5))
            CHECK_NEAR(b, a, 1e-5);
    }
    CHECK(worst <= 1e-5);
    printf("forms differ by at most %.1e\n", worst);
}

/* A wall of height h and (almost) endless width, at distance d: ½ (1 − d / √(d² + h²)). */
static void test_wall(void)
{
    static const double none[3], up[3] = {0, 0, 1};
    for (double d = 0.01; d < 20; d *= 3)
        for (double h = 0.1; h < 50; h *= 4) {
            const struct shape wall = {{{d, -1e6, 0}, {d, 1e6, 0}, {d, 1e6, h}, {d, -1e6, h}}, 4};
            CHECK_NEAR(occlusion_of(&wall, none, up, CRANNY_FORM_ANGLES),
                       0.5 * (1 - d / sqrt(d * d + h * h)), 1e-5);
        }
}

/* A disc of radius r over the point: r² / (r² + h²); here of 720 triangles. */
static void test_disc(void)
{
    static const double none[3], up[3] = {0, 0, 1};
    enum { SLICES = 720 };
    for (double h = 0.1; h < 10; h *= 2) {
        double sum = 0;
        for (int i = 0; i < SLICES; i++) {
            const double a = 2 * PI * i / SLICES, b = 2 * PI * (i + 1) / SLICES;
            const struct shape slice = {{{0, 0, h}, {cos(a), sin(a), h}, {cos(b), sin(b), h}}, 3};
            sum += occlusion_of(&slice, none, up, CRANNY_FORM_SEGMENTS);
        }
        CHECK_NEAR(sum, 1 / (1 + h * h), 2e-5);
    }
}

/* From anywhere inside, facing anywhere, the six sides of a box hide everything. */
static void test_box(void)
{
    for (int i = 0; i < 1000; i++) {
        double point[3], normal[3], sum = 0;
        draw_direction(normal);
        for (int k = 0; k < 3; k++)
            point[k] = 0.01 + 0.98 * draw();
        for (int side = 0; side < 6; side++) {
            const int axis = side / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
            struct shape s = {.count = 4};
            for (int c = 0; c < 4; c++) {
                s.corners[c][axis] = side % 2;
                s.corners[c][u] = c == 1 || c == 2;
                s.corners[c][v] = c >= 2;
            }
            sum += occlusion_of(&s, point, normal, i & 1);
        }
        CHECK_NEAR(sum, 1, 1e-9);
    }
}

/* Through, in and beside the tangent plane; without size; of any size. */
static void test_extremes(void)
{
    static const double none[3], up[3] = {0, 0, 1};
    static const struct shape flat = {{{1, 0, 0}, {2, 0, 0}, {1, 1, 0}}, 3};
    static const struct shape around = {{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}, 4};
    static const struct shape edge_on = {{{1, 0, 0.1}, {2, 0, 0.1}, {3, 0, 1}}, 3};
    static const struct shape touching = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 1}}, 3};
    static const struct shape below = {{{-1, -1, -1}, {1, -1, -1}, {0, 1, -1e-9}}, 3};
    static const struct shape pin = {{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, 3};
    static const struct shape all = {
        {{-1e9, -1e9, 1}, {1e9, -1e9, 1}, {1e9, 1e9, 1}, {-1e9, 1e9, 1}}, 4};
    static const struct shape one = {{{1, 0, 1}, {0, 1, 1}, {-1, -1, 1}}, 3};
    const double unit = occlusion_of(&one, none, up, CRANNY_FORM_ANGLES);
    for (int form = CRANNY_FORM_ANGLES; form <= CRANNY_FORM_SEGMENTS; form++) {
        CHECK_NEAR(occlusion_of(&flat, none, up, form), 0, 0);
        CHECK_NEAR(occlusion_of(&edge_on, none, up, form), 0, 1e-12);
        CHECK_NEAR(occlusion_of(&below, none, up, form), 0, 0);
        CHECK_NEAR(occlusion_of(&pin, none, up, form), 0, 0);
        CHECK_NEAR(occlusion_of(&all, none, up, form), 1, 1e-8);
        CHECK(isfinite(occlusion_of(&around, none, up, form)));
        CHECK(isfinite(occlusion_of(&touching, none, up, form)));
        for (double scale = 1e-300; scale < 1e300; scale *= 1e10) {
            const struct shape s = {{{scale, 0, scale}, {0, scale, scale}, {-scale, -scale, scale}},
                                    3};
            CHECK_NEAR(occlusion_of(&s, none, up, form), unit, 1e-9);
        }
    }
    CHECK_NEAR(cranny_polygon_occlusion((const double(*)[3])flat.corners, 2, none, up, 0), 0, 0);
    CHECK_NEAR(cranny_polygon_occlusion((const double(*)[3])flat.corners, 9, none, up, 0), 0, 0);
}

int main(int argc, char **argv)
{
    test_against_rays(argc > 1 ? atoi(argv[1]) : 200);
    test_forms_agree();
    test_wall();
    test_disc();
    test_box();
    test_extremes();
    return check_end("volumes");
}
