/* Based on: Kajalin, Screen-Space Ambient Occlusion, ShaderX7 §6.1, 2009.
 *
 * `world` false: the published kernel. Offsets are a share of the screen and of twice the depth,
 * over the whole sphere; a flat wall is ½ open, then lifted to ¾ by the final curve. `world` true:
 * the chapter's "future improvement" with normals. Offsets are metres, in the hemisphere: unit
 * vectors plus the normal are cosine-distributed, and with lengths spread evenly over the radius
 * the share of open samples is obscurance with linear falloff, for occluders that are thick. Only
 * what is above the tangent plane occludes, so that flat walls stay white. */

/* The published rotation matrix, which takes (0, 0, 1) to `r`, with the signs of a rotation where
 * the print has m10 and m20 otherwise; or the mirror of Mittring 2007. */
FUNCTION lane_3 ssao_turn(CONSTANTS_ARG lane_3 o, lane_3 r)
{
    if (ON(mirror)) {
        const lane_f twice = 2.0f * dot3(o, r);
        return sub3(o, scale3(r, twice));
    }
    const lane_f h = 1.0f / (1.0f + r.z);
    const lane_f across = -h * r.x * r.y;
    return vec3_(o.x * (h * r.y * r.y + r.z) + o.y * across + o.z * r.x,
                 o.x * across + o.y * (h * r.x * r.x + r.z) + o.z * r.y,
                 o.z * r.z - o.x * r.x - o.y * r.y);
}

/* A unit vector from the pixel's turn and jitter; z stays above −1, where the matrix is singular.
 */
FUNCTION lane_3 ssao_rotation(pixel p)
{
    const lane_f z = 1.8f * p.jitter - 0.8f;
    const lane_f ring = sqrt_(max_(1.0f - z * z, splat(0.0f)));
    return vec3_(ring * p.cosine, ring * p.sine, z);
}

FUNCTION lane_f ssao_published(VIEW_ARG CONSTANTS_ARG pixel p)
{
    const lane_f zero = splat(0.0f), one = splat(1.0f);
    const lane_3 rotation = ssao_rotation(p);
    lane_f sum = zero;
    for (int i = 0; i < K(samples); i++) {
        const lane_3 offset =
            vec3_(splat(K(table)[i][0]), splat(K(table)[i][1]), splat(K(table)[i][2]));
        const lane_3 o = ssao_turn(CONSTANTS_PASS offset, rotation);
        const surface s =
            read_surface(VIEW_PASS p.x + o.x * K(kernel_x), p.y + o.y * K(kernel_y), 1);
        const lane_f wanted = p.depth + o.z * p.depth * K(kernel_z);
        const lane_f range = saturate_((p.depth - s.depth) / s.depth);
        const lane_f open = select_(less_(wanted, s.depth), one, zero);
        sum = sum + open + (K(range_default) - open) * range;
    }
    const lane_f a = sum * (1.0f / float_(K(samples)));
    return ON(curve) ? a * a + a : a;
}

FUNCTION lane_f ssao_hemisphere(VIEW_ARG CONSTANTS_ARG pixel p)
{
    const lane_f zero = splat(0.0f), one = splat(1.0f);
    const lane_3 rotation = ssao_rotation(p);
    const lane_f bias = view_w(VIEW_PASS p.depth) * K(bias);
    lane_f sum = zero, taken = zero;
    for (int i = 0; i < K(samples); i++) {
        const lane_3 unit =
            vec3_(splat(K(table)[i][0]), splat(K(table)[i][1]), splat(K(table)[i][2]));
        lane_3 o = ssao_turn(CONSTANTS_PASS unit, rotation);
        if (ON(cosine)) {
            o = add3(o, p.normal);
            o = scale3(o, 1.0f / sqrt_(max_(dot3(o, o), splat(1e-6f))));
        } else {
            o = scale3(o, select_(less_(dot3(o, p.normal), zero), -one, one));
        }
        const lane_f part = K(table)[i][3] + p.jitter * (1.0f / float_(K(samples)));
        const lane_f reach = ON(spread) ? part * part : part;
        const lane_3 q = add3(p.position, scale3(o, reach * K(radius)));
        const place at = project(VIEW_PASS q);
        const surface s = read_surface(VIEW_PASS at.x, at.y, K(clamp));
        const lane_3 v = sub3(s.position, p.position);
        const lane_f behind = -q.z - s.depth; /* the sample, behind the surface */
        const lane_b solid = and_(less_(zero, behind), less_(bias, dot3(v, p.normal)));
        /* The range check: surfaces are as thick as `thickness`. */
        const lane_f range = saturate_(behind * (1.0f / K(thickness)) - 1.0f);
        const lane_f closed = select_(solid, 1.0f - range, zero);
        const lane_b counts = and_(s.counts, less_(splat(1e-6f), -q.z));
        sum = sum + select_(counts, closed, zero);
        taken = taken + select_(counts, one, zero);
    }
    return sum / max_(taken, one);
}

FUNCTION lane_f ssao_estimate(VIEW_ARG CONSTANTS_ARG pixel p)
{
    if (ON(world))
        return finish_(CONSTANTS_PASS ssao_hemisphere(VIEW_PASS CONSTANTS_PASS p));
    return finish_(CONSTANTS_PASS 1.0f - saturate_(ssao_published(VIEW_PASS CONSTANTS_PASS p)));
}
