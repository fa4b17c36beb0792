/* Based on: McGuire, Osman, Bukowski, Hennessy, The Alchemy Screen-Space Ambient Obscurance
 * Algorithm, 2011, eq. 10: A = max(0, 1 − (2σ/s) Σ max(0, v·n + z_C β) / (v·v + ε))^k.
 *
 * Departures: the terms have the unit 1/m; `amount` holds 2 σ u with u = 2 radius, so that the
 * picture follows the radius through scales and is eq. 10 at the paper's radius of 0.5 m. ε is a
 * share of radius². z_C β is a share of the height that the picture spans at that depth, which is
 * the same at the paper's lens, and does not grow with the distance of a long one. `falloff` none
 * is the paper's; the calibrated one reaches zero at the radius.
 */

/* Samples of a pixel by the projected radius: bands of halved size (Fig. 5). */
FUNCTION lane_f alchemy_count(CONSTANTS_ARG lane_f radius_px)
{
    const float share = float_(K(samples)) / float_(K(bands));
    lane_f count = splat(float_(K(samples)));
    float limit = K(band_begin);
    for (int band = 1; band < K(bands); band++) {
        count = count - select_(less_(radius_px, splat(limit)), splat(share), splat(0.0f));
        limit = limit * 0.5f;
    }
    return floor_(count + 0.5f);
}

/* table[i]: cosine and sine of the spiral's angle. */
FUNCTION lane_f alchemy_estimate(VIEW_ARG CONSTANTS_ARG pixel p)
{
    const lane_f zero = splat(0.0f), one = splat(1.0f);
    const lane_f count = alchemy_count(CONSTANTS_PASS p.radius_x);
    const lane_f per_sample = one / count;
    const lane_f bias = view_w(VIEW_PASS p.depth) * K(bias);
    lane_f sum = zero, taken = zero;
    for (int i = 0; i < K(samples); i++) {
        const lane_b within = less_(splat(float_(i)), count);
        if (!any_(within))
            break;
        /* On a spiral that each pixel turns. Uniform over the disk's area as published; or
         * `spread`: more of them near the pixel, each weighted by the solid angle dA / d² that its
         * ring of the disk stands for instead of by its area, which is what eq. 6 integrates over.
         */
        const lane_f part = min_((float_(i) + p.jitter) * per_sample, one);
        const lane_f ring = ON(spread) ? part * part : sqrt_(part);
        const lane_f weight = ON(spread) ? 2.0f * part : one;
        const lane_f ox = ring * (K(table)[i][0] * p.cosine - K(table)[i][1] * p.sine);
        const lane_f oy = ring * (K(table)[i][0] * p.sine + K(table)[i][1] * p.cosine);
        const surface s =
            read_surface(VIEW_PASS p.x + ox * p.radius_x, p.y + oy * p.radius_y, K(clamp));
        const lane_3 v = sub3(s.position, p.position);
        const lane_f vv = dot3(v, v);
        const lane_f vn = max_(dot3(v, p.normal) - bias, zero);
        const lane_f term = weight * vn / (vv + K(epsilon)) *
                            falloff_(CONSTANTS_PASS vv, K(falloff) == 2 ? sqrt_(vv) : vv);
        const lane_b counts = and_(within, s.counts);
        sum = sum + select_(counts, term, zero);
        taken = taken + select_(counts, one, zero);
    }
    return finish_(CONSTANTS_PASS sum / max_(taken, one));
}
