/* Based on: Bavoil, Sainz, Image-Space Horizon-Based Ambient Occlusion, ShaderX7 §6.2, 2009, "Image
 * Space Ambient Occlusion with Ray Marching": the brute force that knows all that a depth buffer
 * knows. Rays over the hemisphere of the normal, in even steps from P to P + R ω; a ray hits at the
 * first sample below which it runs, and samples farther than R are ignored ("Avoiding Outliers").
 *
 * table[i]: a direction in the normal's frame, cosine-distributed (eq. 6.2.1) or even (eq. 6.2.2).
 */

struct axes {
    lane_3 t, b;
};
RECORD(axes)

/* Two axes across a unit vector. Based on: Duff, Burgess, Christensen, Hery, Kensler, Liani,
 * Villemin, Building an Orthonormal Basis, Revisited, 2017. */
FUNCTION axes raymarch_axes(lane_3 n)
{
    const lane_f sign = select_(less_(n.z, splat(0.0f)), splat(-1.0f), splat(1.0f));
    const lane_f a = -1.0f / (sign + n.z);
    const lane_f c = n.x * n.y * a;
    axes across;
    across.t = vec3_(1.0f + sign * n.x * n.x * a, sign * c, -sign * n.x);
    across.b = vec3_(c, sign + n.y * n.y * a, -n.y);
    return across;
}

FUNCTION lane_f raymarch_estimate(VIEW_ARG CONSTANTS_ARG pixel p)
{
    const lane_f zero = splat(0.0f), one = splat(1.0f);
    const lane_f bias = view_w(VIEW_PASS p.depth) * K(bias);
    const float step = 1.0f / float_(K(steps));
    const axes across = raymarch_axes(p.normal);
    lane_f sum = zero, taken = zero;
    for (int i = 0; i < K(samples); i++) {
        const lane_f x = K(table)[i][0] * p.cosine - K(table)[i][1] * p.sine;
        const lane_f y = K(table)[i][0] * p.sine + K(table)[i][1] * p.cosine;
        const lane_3 ray = add3(add3(scale3(across.t, x), scale3(across.b, y)),
                                scale3(p.normal, splat(K(table)[i][2])));
        lane_f hit = zero, inside = zero;
        lane_b open = less_(zero, one);
        for (int j = 0; j < K(steps); j++) {
            /* Even steps as published, or closer ones near the pixel. */
            const lane_f even = (float_(j) + p.jitter) * step;
            const lane_f along = (ON(spread) ? even * even : even) * K(radius);
            const lane_3 q = add3(p.position, scale3(ray, along));
            const place at = project(VIEW_PASS q);
            const surface s = read_surface(VIEW_PASS at.x, at.y, K(clamp));
            const lane_3 v = sub3(s.position, p.position);
            const lane_f vv = dot3(v, v);
            lane_b met = and_(less_(s.depth, -q.z), less_(bias, dot3(v, p.normal)));
            met = and_(and_(met, open), and_(s.counts, less_(vv, splat(K(radius2)))));
            met = and_(met, less_(-q.z - s.depth, splat(K(thickness))));
            hit = select_(met, falloff_(CONSTANTS_PASS vv, sqrt_(vv)), hit);
            open = and_(open, not_(met));
            inside = max_(inside, select_(s.counts, one, zero));
            if (!any_(open))
                break;
        }
        sum = sum + hit;
        taken = taken + inside;
    }
    return finish_(CONSTANTS_PASS sum / max_(taken, one));
}
