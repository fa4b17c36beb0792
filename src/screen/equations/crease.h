/* Based on: Fox, Compton, Ambient Occlusive Crease Shading, Game Developer, March 2008.
 *
 * 24 neighbours on a stippled 11×11 diamond; each adds
 * saturate((dot(v/|v|, n) − minimum) × bias) × (1 − saturate(|v| / range)), and `averager` divides.
 *
 * Departures: the kernel is scaled with the picture's height (paper) or spans the projected radius
 * and is turned and sized per pixel (`world`), so that the look does not change with resolution. */

/* table[i]: offset in units of the kernel. */
FUNCTION lane_f crease_estimate(VIEW_ARG CONSTANTS_ARG pixel p)
{
    const lane_f zero = splat(0.0f), one = splat(1.0f);
    const lane_f bias = view_w(VIEW_PASS p.depth) * K(bias);
    lane_f sum = zero, taken = zero;
    for (int i = 0; i < K(samples); i++) {
        lane_f ox = splat(K(table)[i][0] * K(kernel_x)), oy = splat(K(table)[i][1] * K(kernel_y));
        if (ON(world)) {
            /* Of all sizes, small ones more often: contacts are what creases are. */
            const lane_f size = 0.05f + p.jitter * p.jitter;
            ox = p.radius_x * size * (K(table)[i][0] * p.cosine - K(table)[i][1] * p.sine);
            oy = p.radius_y * size * (K(table)[i][0] * p.sine + K(table)[i][1] * p.cosine);
        }
        const surface s = read_surface(VIEW_PASS p.x + ox, p.y + oy, K(clamp));
        const lane_3 v = sub3(s.position, p.position);
        const lane_f vv = dot3(v, v);
        const lane_f distance = sqrt_(max_(vv, splat(1e-30f)));
        const lane_f inverse = 1.0f / distance;
        const lane_f facing = (dot3(v, p.normal) - bias) * inverse;
        lane_f term = saturate_((facing - K(minimum_crease)) * K(crease_scale)) *
                      falloff_(CONSTANTS_PASS vv, distance);
        if (ON(facing)) {
            const lane_3 n = READ_NORMAL(s.index);
            term = term * saturate_(-dot3(v, n) * inverse);
        }
        sum = sum + select_(s.counts, term, zero);
        taken = taken + select_(s.counts, one, zero);
    }
    /* The divisor belongs to all samples: those beyond the frame weigh as the others do. */
    return finish_(CONSTANTS_PASS sum * (float_(K(samples)) / max_(taken, one)));
}
