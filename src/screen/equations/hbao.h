/* Based on: Bavoil, Sainz, Image-Space Horizon-Based Ambient Occlusion, ShaderX7 §6.2, 2009.
 *
 * Eq. 6.2.9: A = 1 − 1/(2π) ∫ Σ W(ω_i) [(sin φ_i − sin t_i) − (sin φ_{i−1} − sin t_{i−1})] dθ, the
 * bracket being the height of a sample over its own tangent, so that snapping raises nothing.
 * The tangent is that of the plane at the sample's own azimuth, which a screen-aligned basis (eq.
 * 6.2.11) gives at the cost of perspective.
 *
 * `cosine` (calibrated) puts the cosine of eq. 6.2.1 into the integral. The slice of a direction
 * then holds the view vector V instead of Z; for a sample in unit direction s, with c = s·V, q =
 * s·n, and n_d the normal's part along the slice's other axis, what lies between the tangent and
 * the sample occludes G = ½ (c q + n_d e), e the angle of s over the tangent: the integral of cos(θ
 * − γ) sin θ. Samples add W (G_i − G_max) as in eq. 6.2.9; 2/N_d Σ G is 1 for a closed hemisphere.
 */

/* Eq. 6.2.9's bracket. `v`: to the sample, `inverse`: 1 over its length. */
FUNCTION lane_f hbao_height(CONSTANTS_ARG pixel p, lane_3 v, lane_f inverse)
{
    const lane_f flat2 = max_(v.x * v.x + v.y * v.y, splat(1e-30f));
    const lane_f sine = v.z * inverse;
    /* The plane over this azimuth: n·(x, y, z) = 0. */
    const lane_f rise = -(p.normal.x * v.x + p.normal.y * v.y) / max_(p.normal.z, splat(1e-3f));
    const lane_f along = 1.0f / sqrt_(rise * rise + flat2);
    const lane_f sine_t = rise * along, cosine_t = sqrt_(flat2) * along;
    /* sin(t + bias): directions below the bias do not count ("Angle Bias"). */
    const lane_f grounded = sine - (sine_t * K(cosine_bias) + cosine_t * K(sine_bias));
    /* Where the plane is seen along or from behind Z, only what is above it counts. */
    const lane_f above = dot3(p.normal, v) * inverse;
    return select_(less_(splat(K(sine_bias)), above), max_(grounded, splat(0.0f)), splat(0.0f));
}

/* G, see above. `view`: unit, to the camera; `nv` = n·view. */
FUNCTION lane_f hbao_cosine_height(CONSTANTS_ARG pixel p, lane_3 view, lane_f nv, lane_3 v,
                                   lane_f inverse)
{
    const lane_f zero = splat(0.0f), one = splat(1.0f), tiny = splat(1e-12f);
    const lane_f q = dot3(p.normal, v) * inverse;
    const lane_f c = dot3(view, v) * inverse;
    /* s: the sine of the angle from the view vector; m = n_d s. The normal's length within the
     * slice is √(nv² + n_d²) = t / s. */
    const lane_f s2 = max_(1.0f - c * c, tiny), s = sqrt_(s2);
    const lane_f m = q - c * nv;
    const lane_f t = sqrt_(max_(nv * nv * s2 + m * m, tiny));
    const lane_f both = 1.0f / (s * t);
    const lane_f nd = m * (both * t);
    const lane_f e = 1.57079633f - acos_(clamp_(q * s * (both * s), -1.0f, 1.0f));
    const lane_f g = 0.5f * (c * q + nd * e) - 0.5f * (K(sine_bias) * K(sine_bias));
    /* q ≤ sin(bias): below the tangent, or too little above it. */
    return select_(less_(splat(K(sine_bias)), q), min_(max_(g, zero), one), zero);
}

/* Sum over all directions, for one of the two integrals. table[i]: cosine and sine of direction i.
 */
FUNCTION lane_f hbao_sum(VIEW_ARG CONSTANTS_ARG pixel p, lane_3 view, const int cosine)
{
    const lane_f zero = splat(0.0f), one = splat(1.0f);
    const lane_f nv = dot3(p.normal, view);
    const float step = 1.0f / float_(K(steps) + 1);
    lane_f sum = zero, taken = zero;
    for (int d = 0; d < K(directions); d++) {
        const lane_f dx = p.radius_x * (K(table)[d][0] * p.cosine - K(table)[d][1] * p.sine);
        const lane_f dy = p.radius_y * (K(table)[d][0] * p.sine + K(table)[d][1] * p.cosine);
        lane_f horizon = zero, within = zero;
        for (int i = 0; i < K(steps); i++) {
            /* Even steps as published, or closer ones near the pixel. */
            const lane_f even = (float_(i) + p.jitter + 0.5f) * step;
            const lane_f along = ON(spread) ? even * even : even;
            const surface s = read_surface(VIEW_PASS p.x + dx * along, p.y + dy * along, K(clamp));
            const lane_3 v = sub3(s.position, p.position);
            const lane_f vv = dot3(v, v);
            const lane_f inverse = 1.0f / sqrt_(max_(vv, splat(1e-30f)));
            const lane_f height = cosine != 0
                                      ? hbao_cosine_height(CONSTANTS_PASS p, view, nv, v, inverse)
                                      : hbao_height(CONSTANTS_PASS p, v, inverse);
            const lane_f rise = max_(height - horizon, zero);
            const lane_b counts = and_(s.counts, less_(vv, splat(K(radius2))));
            const lane_f weight = falloff_(CONSTANTS_PASS vv, vv * inverse);
            sum = sum + select_(counts, rise * weight, zero);
            horizon = select_(counts, max_(horizon, height), horizon);
            within = within + select_(s.counts, one, zero);
        }
        /* Directions that leave the frame at once say nothing. */
        taken = taken + select_(less_(zero, within), one, zero);
    }
    return sum / max_(taken, one);
}

FUNCTION lane_f hbao_estimate(VIEW_ARG CONSTANTS_ARG pixel p)
{
    const lane_f zero = splat(0.0f);
    const lane_f away = sqrt_(max_(dot3(p.position, p.position), splat(1e-30f)));
    const lane_3 view =
        VIEW(orthographic) != 0 ? vec3_(zero, zero, splat(1.0f)) : scale3(p.position, -1.0f / away);
    if (ON(cosine))
        return finish_(CONSTANTS_PASS hbao_sum(VIEW_PASS CONSTANTS_PASS p, view, 1));
    return finish_(CONSTANTS_PASS hbao_sum(VIEW_PASS CONSTANTS_PASS p, view, 0));
}
