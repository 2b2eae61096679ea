"""Compiled likelihoods of overturning with P(x) = F(a + b z), z a scaled ln x: fits and profiles, many at once.

Two kinds of counts: overturnings k of n runs at each level (binomial), and motions by the interval between two levels
in which they first overturn (interval). Three links F: probit, logit, complementary log-log. A penalty, half the
logarithm of the determinant of the binomial's expected information (Jeffreys' prior), keeps estimates finite if
overturnings and survivals do not overlap. `fitting.likelihood` and `fitting.intervals` call these kernels.
"""

import math

import numpy as np

from ...core.compiled import kernel

PROBIT, LOGIT, CLOGLOG = range(3)
BINOMIAL, INTERVAL = range(2)
# Statuses of a fit.
OK, NO_RUNS, ONE_LEVEL, NONE, ALL, SEPARATED, DECREASING, FAILED = range(8)
# Conditions for a penalty.
NEVER, WHERE_SEPARATED, ALWAYS = range(3)
# Columns of a fit; the last three are minus the Hessian of its objective.
A, B, LOG_LIKELIHOOD, STATUS, PENALISED, ITERATIONS, HAA, HAB, HBB = range(9)
COLUMNS = 9
STATES = 3
# Parameters that a profile may have.
FRACTILE, SLOPE = range(2)

ROOT_HALF = math.sqrt(0.5)
LOG_ROOT_2PI = 0.5 * math.log(2.0 * math.pi)
ROOT_2PI = math.sqrt(2.0 * math.pi)
# Largest exponent that is used.
LARGE = 600.0
SCRATCH = 9
MAX_ITERATIONS = 100
# Relative size of the last step of a search: of a single fit, of a fit to one of many replicates, and where only the
# value matters.
PRECISE = 1e-11
OF_MANY = 1e-6
VALUE_ONLY = 1e-5
# Relative size of the last step to the end of an interval.
OF_END = 1e-12
# ln Phi is a Taylor polynomial about the nearest of NODES a unit, where |eta| is below EDGE.
EDGE = 4
NODES = 16
DEGREE = 11
MAX_HALVINGS = 60


def probit_polynomials():
    """Taylor coefficients of ln Phi(x) and ln Phi(-x) about nodes from -EDGE to EDGE; (node, DEGREE + 1, 2).

    Its slope h = phi/Phi has h' = -h (x + h), which gives one coefficient after the other.  Half a node's distance away
    the first term left out is below 1e-17 of the value, since it falls as (x/2 NODES)^n/n! in the upper tail.
    """
    table = np.zeros((2 * EDGE * NODES + 1, DEGREE + 1))
    for j in range(table.shape[0]):
        x = j / NODES - EDGE
        below = 0.5 * math.erfc(-x * ROOT_HALF)
        h = [math.exp(-0.5 * x * x) / (ROOT_2PI * below)]
        for k in range(DEGREE - 1):
            product = sum(h[i] * h[k - i] for i in range(k + 1))
            h.append(-(x * h[k] + (h[k - 1] if k else 0.0) + product) / (k + 1))
        table[j, 0] = math.log(below) if x < 0.0 else math.log1p(-0.5 * math.erfc(x * ROOT_HALF))
        for k in range(DEGREE):
            table[j, k + 1] = h[k] / (k + 1)
    return np.stack([table, table[::-1] * (-1.0) ** np.arange(DEGREE + 1)], axis=-1)


POLYNOMIALS = probit_polynomials()


@kernel(fastmath={"contract"})
def near_probit(eta):
    """Return `tails` of the probit at |eta| < EDGE from the polynomials and their slopes, several times as fast."""
    j = int((eta + EDGE) * NODES + 0.5)
    t = eta - (j / NODES - EDGE)
    log_p = POLYNOMIALS[j, DEGREE, 0]
    log_q = POLYNOMIALS[j, DEGREE, 1]
    u = v = 0.0
    for k in range(DEGREE - 1, -1, -1):
        u = log_p + t * u
        v = log_q + t * v
        log_p = POLYNOMIALS[j, k, 0] + t * log_p
        log_q = POLYNOMIALS[j, k, 1] + t * log_q
    return log_p, log_q, -0.5 * eta * eta - LOG_ROOT_2PI, u, -v, -eta, -1.0


@kernel()
def mills_ratio(x):
    """Return (1 - Phi(x))/phi(x) for x >= 3 by Laplace's continued fraction, deep enough for double precision."""
    value = x
    for i in range(10 + int(250.0 / (x * x)), 0, -1):
        value = x + i / value
    return 1.0 / value


@kernel()
def tails(eta, link):
    """Return (ln F, ln(1 - F), ln f, f/F, f/(1 - F), f'/f, (f'/f)') at eta, accurate in both tails."""
    if link == PROBIT:
        x = abs(eta)
        log_f = -0.5 * x * x - LOG_ROOT_2PI
        if x < 3.0:
            small = 0.5 * math.erfc(x * ROOT_HALF)
            f = math.exp(log_f)
            log_small = math.log(small)
            hazard = f / small
        else:
            ratio = mills_ratio(x)
            # exp(-x²/2) in two parts, since the rounding of a large x² would change the result
            head = math.floor(16.0 * x) / 16.0
            f = math.exp(-0.5 * head * head) * math.exp(-0.5 * (x - head) * (x + head)) / ROOT_2PI
            small = f * ratio
            log_small = log_f + math.log(ratio)
            hazard = 1.0 / ratio
        log_large = math.log1p(-small)
        reverse = f / (1.0 - small)
        if eta < 0.0:
            return log_small, log_large, log_f, hazard, reverse, -eta, -1.0
        return log_large, log_small, log_f, reverse, hazard, -eta, -1.0
    if link == LOGIT:
        e = math.exp(-abs(eta))
        small = e / (1.0 + e)
        large = 1.0 / (1.0 + e)
        log_large = -math.log1p(e)
        log_small = log_large - abs(eta)
        log_f = log_large + log_small
        if eta < 0.0:
            return log_small, log_large, log_f, large, small, large - small, -2.0 * small * large
        return log_large, log_small, log_f, small, large, small - large, -2.0 * small * large
    rate = math.exp(min(eta, LARGE))
    if eta < -36.0:  # 1 - exp(-rate) is the rate to rounding
        return eta, -rate, eta - rate, 1.0, rate, 1.0 - rate, -rate
    return (
        math.log(-math.expm1(-rate)),
        -rate,
        eta - rate,
        rate / math.expm1(rate) if rate < LARGE else 0.0,
        rate,
        1.0 - rate,
        -rate,
    )


@kernel()
def at_level(eta, link):
    """Return `tails` by the cheapest way."""
    return near_probit(eta) if link == PROBIT and abs(eta) < EDGE else tails(eta, link)


@kernel()
def log_less(x):
    """Return ln(1 - exp(x)) for x <= 0."""
    return math.log(-math.expm1(x)) if x < 0.0 else -np.inf


@kernel(keep=True)
def evaluate(kind, link, a, b, z, k, n, penalised, scratch):
    """Objective at (a, b): its value, the log-likelihood alone, gradient (2), minus the Hessian (3), information (3).

    z, n (level,); k (level,) overturnings, or (level + 1,) motions by interval.  The information is minus the Hessian
    of the log-likelihood alone, which is concave.  scratch (SCRATCH, level).
    """
    levels = z.size
    plain = 0.0
    ga = gb = 0.0
    haa = hab = hbb = 0.0
    for i in range(levels):
        eta = a + b * z[i]
        log_p, log_q, log_f, u, v, r, dr = at_level(eta, link)
        if kind == BINOMIAL:
            fell = k[i]
            stood = n[i] - fell
            score = 0.0
            curvature = 0.0
            if fell > 0.0:
                plain += fell * log_p
                score += fell * u
                curvature += fell * u * (u - r)
            if stood > 0.0:
                plain += stood * log_q
                score -= stood * v
                curvature += stood * v * (v + r)
            ga += score
            gb += score * z[i]
            haa += curvature
            hab += curvature * z[i]
            hbb += curvature * z[i] * z[i]
        else:
            scratch[4, i] = log_p
            scratch[5, i] = log_q
            scratch[6, i] = log_f
            scratch[7, i] = r
            scratch[8, i] = eta
        if penalised:
            weight = n[i] * u * v
            scratch[0, i] = scratch[1, i] = scratch[2, i] = 0.0
            if weight > 0.0:
                slope = 2.0 * r - u + v
                bend = 2.0 * dr - u * (r - u) + v * (r + v)
                scratch[0, i] = weight
                scratch[1, i] = weight * slope
                scratch[2, i] = weight * (slope * slope + bend)
    if kind == INTERVAL:
        if not b > 0.0:
            return -np.inf, -np.inf, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0
        for j in range(levels + 1):
            if k[j] == 0.0:
                continue
            # eta below and above the interval: density over probability, and the logarithmic slope of the density
            low = high = low_r = high_r = low_z = high_z = 0.0
            if j == 0:
                log_pi = scratch[4, 0]
            elif j == levels:
                log_pi = scratch[5, levels - 1]
            elif scratch[8, j] <= 0.0:
                log_pi = scratch[4, j] + log_less(scratch[4, j - 1] - scratch[4, j])
            elif scratch[8, j - 1] >= 0.0:
                log_pi = scratch[5, j - 1] + log_less(scratch[5, j] - scratch[5, j - 1])
            else:
                outside = math.exp(scratch[4, j - 1]) + math.exp(scratch[5, j])
                log_pi = math.log1p(-outside) if outside < 1.0 else -np.inf
            if log_pi == -np.inf:
                return -np.inf, -np.inf, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0
            if j > 0:
                low = math.exp(scratch[6, j - 1] - log_pi)
                low_r = scratch[7, j - 1]
                low_z = z[j - 1]
            if j < levels:
                high = math.exp(scratch[6, j] - log_pi)
                high_r = scratch[7, j]
                high_z = z[j]
            plain += k[j] * log_pi
            ga += k[j] * (high - low)
            gb += k[j] * (high * high_z - low * low_z)
            # minus the second derivatives with respect to eta above, both, and below
            above = k[j] * high * (high - high_r)
            both = -k[j] * high * low
            below = k[j] * low * (low + low_r)
            haa += above + 2.0 * both + below
            hab += above * high_z + both * (high_z + low_z) + below * low_z
            hbb += above * high_z * high_z + 2.0 * both * high_z * low_z + below * low_z * low_z
    if not penalised:
        return plain, plain, ga, gb, haa, hab, hbb, haa, hab, hbb
    iaa, iab, ibb = haa, hab, hbb
    # moments of the weights and of their derivatives about the weighted mean: the determinant is then a product
    m0 = mean = 0.0
    for i in range(levels):
        m0 += scratch[0, i]
        mean += scratch[0, i] * z[i]
    if not m0 > 0.0:
        return -np.inf, plain, ga, gb, haa, hab, hbb, iaa, iab, ibb
    mean /= m0
    m2 = 0.0
    t0 = t1 = t2 = t3 = 0.0
    q0 = q1 = q2 = q3 = q4 = 0.0
    for i in range(levels):
        d = z[i] - mean
        m2 += scratch[0, i] * d * d
        t = scratch[1, i]
        q = scratch[2, i]
        t0 += t
        t1 += t * d
        t2 += t * d * d
        t3 += t * d * d * d
        q0 += q
        q1 += q * d
        q2 += q * d * d
        q3 += q * d * d * d
        q4 += q * d * d * d * d
    if not m2 > 0.0:
        return -np.inf, plain, ga, gb, haa, hab, hbb, iaa, iab, ibb
    value = plain + 0.5 * (math.log(m0) + math.log(m2))
    # over m0 and over m2 apart: their products may be too small
    u0, u1, u2 = t0 / m0, t1 / m0, t2 / m0
    v1, v2, v3 = t1 / m2, t2 / m2, t3 / m2
    pa = 0.5 * (u0 + v2)
    pb = 0.5 * (u1 + v3)
    paa = 0.5 * (q0 / m0 + q2 / m2 - u0 * u0 - 2.0 * u1 * v1 - v2 * v2)
    pab = 0.5 * (q1 / m0 + q3 / m2 - u0 * u1 - u1 * v2 - u2 * v1 - v2 * v3)
    pbb = 0.5 * (q2 / m0 + q4 / m2 - u1 * u1 - 2.0 * u2 * v2 - v3 * v3)
    # back from a + b mean and b to a and b
    ga += pa
    gb += pb + mean * pa
    haa -= paa
    hab -= pab + mean * paa
    hbb -= pbb + 2.0 * mean * pab + mean * mean * paa
    return value, plain, ga, gb, haa, hab, hbb, iaa, iab, ibb


@kernel()
def existence(kind, k, n):
    """Return OK if the likelihood has a finite maximum, else the reason: outcomes must overlap (levels rising)."""
    total = fell = 0.0
    levels = 0
    for i in range(n.size):
        total += n[i]
        levels += 1 if n[i] > 0.0 else 0
    if total == 0.0:
        return NO_RUNS
    if kind == INTERVAL:
        first = -1
        last = -1
        for j in range(k.size):
            if k[j] > 0.0:
                last = j
                if first < 0:
                    first = j
        if first == k.size - 1:
            return NONE
        if last == 0:
            return ALL
        if levels == 1:
            return ONE_LEVEL
        if last - first <= 1:
            return SEPARATED
        if first == 0 and last == k.size - 1:
            for j in range(1, k.size - 1):
                if k[j] > 0.0:
                    return OK
            return DECREASING
        return OK
    first_fell = first_stood = n.size
    last_fell = last_stood = -1
    for i in range(n.size):
        fell += k[i]
        if k[i] > 0.0:
            last_fell = i
            first_fell = min(first_fell, i)
        if k[i] < n[i]:
            last_stood = i
            first_stood = min(first_stood, i)
    if fell == 0.0:
        return NONE
    if last_stood < 0:
        return ALL
    if levels == 1:
        return ONE_LEVEL
    if first_fell >= last_stood:
        return SEPARATED
    if first_stood >= last_fell:
        return DECREASING
    return OK


@kernel()
def first_guess(kind, link, z, k, n):
    """Return (a, b) of a straight line through rough quantiles of the smoothed fractions."""
    below = 0.0
    total = sum_z = sum_y = sum_zz = sum_zy = 0.0
    for i in range(z.size):
        if n[i] == 0.0:
            continue
        below += k[i]
        p = ((below if kind == INTERVAL else k[i]) + 0.5) / (n[i] + 1.0)
        # the logistic quantile over 1.7 is near the normal one
        y = math.log(-math.log1p(-p)) if link == CLOGLOG else math.log(p / (1.0 - p))
        if link == PROBIT:
            y /= 1.7
        total += 1.0
        sum_z += z[i]
        sum_y += y
        sum_zz += z[i] * z[i]
        sum_zy += z[i] * y
    spread = total * sum_zz - sum_z * sum_z
    slope = (total * sum_zy - sum_z * sum_y) / spread if spread > 0.0 else 1.0
    slope = max(slope, 0.1)
    return (sum_y - slope * sum_z) / total, slope


@kernel()
def maximise(kind, link, z, k, n, penalised, a, b, tolerance, scratch):
    """Newton's method with step halving: (a, b, log-likelihood, minus the Hessian (3), iterations, converged).

    The last step, no more than the tolerance (relative), is not evaluated; the remaining error is about its square.
    """
    state = evaluate(kind, link, a, b, z, k, n, penalised, scratch)
    for iteration in range(1, MAX_ITERATIONS + 1):
        value, plain, ga, gb, haa, hab, hbb, iaa, iab, ibb = state
        det = haa * hbb - hab * hab
        near = PRECISE if penalised else tolerance
        if not (haa > 0.0 and det > 0.0):
            haa, hab, hbb = iaa, iab, ibb
            near = 1e-10  # (such steps do not converge quadratically)
            det = haa * hbb - hab * hab
            if not (haa > 0.0 and det > 0.0):
                return a, b, plain, haa, hab, hbb, iteration, False
        da = (hbb * ga - hab * gb) / det
        db = (haa * gb - hab * ga) / det
        if abs(da) <= near * (1.0 + abs(a)) and abs(db) <= near * (1.0 + abs(b)):
            plain += 0.5 * (ga * da + gb * db)
            return a + da, b + db, plain, haa, hab, hbb, iteration, True
        risen = False
        for _ in range(MAX_HALVINGS):
            state = evaluate(kind, link, a + da, b + db, z, k, n, penalised, scratch)
            if state[0] >= value - 1e-12 * abs(value):
                risen = True
                break
            da *= 0.5
            db *= 0.5
        if not risen:
            return a, b, plain, haa, hab, hbb, iteration, False
        a += da
        b += db
    return a, b, state[1], state[4], state[5], state[6], MAX_ITERATIONS, False


@kernel(keep=True)
def fit_many(kind, link, z, k, n, penalty, start, out):
    """Fit many counts at the same levels, into out (replicate, COLUMNS).

    `z` (level,). `n` (replicate, level). `k` (replicate, level), by interval (replicate, level + 1). `start` (2,) or
    (0,): a first guess for all. `penalty`: NEVER, WHERE_SEPARATED or ALWAYS. NaN without a fit; STATUS is the reason.
    """
    scratch = np.zeros((SCRATCH, z.size))
    for i in range(k.shape[0]):
        status = existence(kind, k[i], n[i])
        out[i, :] = np.nan
        out[i, STATUS] = status
        out[i, PENALISED] = 0.0
        out[i, ITERATIONS] = 0.0
        penalised = penalty == ALWAYS or (penalty == WHERE_SEPARATED and status == SEPARATED)
        if not (status == OK or (status == SEPARATED and penalised)):
            continue
        guess = start.size == 0 or status == SEPARATED
        if not guess:
            a, b, plain, haa, hab, hbb, iterations, converged = maximise(
                kind, link, z, k[i], n[i], penalised, start[0], start[1], OF_MANY, scratch
            )
            guess = not converged
        if guess:
            a, b = first_guess(kind, link, z, k[i], n[i])
            a, b, plain, haa, hab, hbb, iterations, converged = maximise(
                kind, link, z, k[i], n[i], penalised, a, b, PRECISE, scratch
            )
        out[i, ITERATIONS] = iterations
        out[i, LOG_LIKELIHOOD] = plain
        out[i, PENALISED] = penalised
        if not converged:
            out[i, STATUS] = FAILED
        elif b <= 0.0:
            out[i, STATUS] = DECREASING
        else:
            out[i, A] = a
            out[i, B] = b
            out[i, HAA] = haa
            out[i, HAB] = hab
            out[i, HBB] = hbb


@kernel(keep=True)
def covariances(kind, link, z, k, n, fits, weights, starts, cells, counts, outcomes, out):
    """Write the covariance of (a, b) of many fits into out (replicate, 3): aa, ab, bb.

    It is from the information alone if `weights` has no columns. Else it is robust against dependence between the runs
    of a motion. `weights` (replicate, pattern) counts the draws of each pattern of outcomes, and
    `cells[starts[p]:starts[p + 1]]` are the cells of pattern p. `counts` is the number of runs in each of them. Cells
    are intervals, or STATES per level, whose outcomes are 1 (overturned), 0 (not overturned) or -1 (no run).
    """
    scratch = np.zeros((SCRATCH, z.size))
    scores = np.zeros((2, outcomes.size if kind == BINOMIAL else z.size + 1))
    single = np.zeros(z.size + 1)
    for r in range(fits.shape[0]):
        out[r, :] = np.nan
        a = fits[r, A]
        b = fits[r, B]
        if not b > 0.0:
            continue
        haa, hab, hbb = fits[r, HAA], fits[r, HAB], fits[r, HBB]
        det = haa * hbb - hab * hab
        if not (haa > 0.0 and det > 0.0):
            continue
        iaa, iab, ibb = hbb / det, -hab / det, haa / det
        if weights.shape[1] == 0:
            out[r, 0] = iaa
            out[r, 1] = iab
            out[r, 2] = ibb
            continue
        if kind == BINOMIAL:
            for level in range(z.size):
                _, _, _, u, v, _, _ = at_level(a + b * z[level], link)
                for cell in range(STATES * level, STATES * (level + 1)):
                    score = 0.0
                    if outcomes[cell] >= 0:
                        score = u if outcomes[cell] == 1 else -v
                    scores[0, cell] = score
                    scores[1, cell] = score * z[level]
        else:
            for cell in range(z.size + 1):
                if k[r, cell] > 0.0:
                    single[cell] = 1.0
                    state = evaluate(kind, link, a, b, z, single, n[r], np.bool_(False), scratch)
                    single[cell] = 0.0
                    scores[0, cell] = state[2]
                    scores[1, cell] = state[3]
        total = maa = mab = mbb = 0.0
        for p in range(weights.shape[1]):
            if weights[r, p] == 0.0:
                continue
            sa = sb = 0.0
            for i in range(starts[p], starts[p + 1]):
                sa += counts[i] * scores[0, cells[i]]
                sb += counts[i] * scores[1, cells[i]]
            total += weights[r, p]
            maa += weights[r, p] * sa * sa
            mab += weights[r, p] * sa * sb
            mbb += weights[r, p] * sb * sb
        if total <= 1.0:
            continue
        factor = total / (total - 1.0)
        xaa = iaa * maa + iab * mab
        xab = iaa * mab + iab * mbb
        xba = iab * maa + ibb * mab
        xbb = iab * mab + ibb * mbb
        out[r, 0] = factor * (xaa * iaa + xab * iab)
        out[r, 1] = factor * (xaa * iab + xab * ibb)
        out[r, 2] = factor * (xba * iab + xbb * ibb)


@kernel()
def maximise_line(kind, link, z, k, n, penalised, line, s, tolerance, scratch):
    """Return the maximum on a line of (a, b), base + s along: s, value, gradient (2); line: base (2), along (2).

    The last step, no more than the tolerance (relative), is not evaluated: the value includes the gain of Newton's
    parabola, the gradient is from before the step.
    """
    base_a, base_b, along_a, along_b = line
    state = evaluate(kind, link, base_a + s * along_a, base_b + s * along_b, z, k, n, penalised, scratch)
    for _ in range(MAX_ITERATIONS):
        value, _, ga, gb, haa, hab, hbb, iaa, iab, ibb = state
        gradient = ga * along_a + gb * along_b
        curvature = haa * along_a * along_a + 2.0 * hab * along_a * along_b + hbb * along_b * along_b
        if not curvature > 0.0:
            curvature = iaa * along_a * along_a + 2.0 * iab * along_a * along_b + ibb * along_b * along_b
            if not curvature > 0.0:
                break
        step = gradient / curvature
        if abs(step) <= tolerance * (1e-3 + abs(s)):
            return s + step, value + 0.5 * gradient * step, ga, gb
        risen = False
        for _ in range(MAX_HALVINGS):
            t = s + step
            state = evaluate(kind, link, base_a + t * along_a, base_b + t * along_b, z, k, n, penalised, scratch)
            if state[0] >= value - 1e-13 * abs(value):
                risen = True
                break
            step *= 0.5
        if not risen:
            state = evaluate(kind, link, base_a + s * along_a, base_b + s * along_b, z, k, n, penalised, scratch)
            break
        s += step
    return s, state[0], state[2], state[3]


@kernel(keep=True)
def profile(kind, link, z, k, n, penalised, what, eta, at, s, tolerance, scratch):
    """Return the largest value with z of the fractile F^-1(p) = eta, or ln b, at `at`; its slope; the free parameter.

    s: a first guess of the free parameter; tolerance: of the free parameter, see `maximise_line`.
    """
    if what == SLOPE:
        b = math.exp(at)
        s, value, _, gb = maximise_line(kind, link, z, k, n, penalised, (0.0, b, 1.0, 0.0), s, tolerance, scratch)
        return value, gb * b, s
    s, value, ga, _ = maximise_line(kind, link, z, k, n, penalised, (eta, 0.0, -at, 1.0), s, tolerance, scratch)
    if not s > 0.0:  # a curve does not decrease
        value = evaluate(kind, link, eta, 0.0, z, k, n, penalised, scratch)[0]
        return value, 0.0, 0.0
    return value, -s * ga, s


@kernel(keep=True)
def profile_end(kind, link, z, k, n, penalised, what, eta, a, b, drop, side):
    """Return the parameter at which the profile is `drop` below its value at (a, b), on a side (+1, -1), or +-inf.

    The end is infinite if the profile never drops so far. `what`: FRACTILE, its place on z with F^-1(p) = eta; SLOPE,
    ln b.
    """
    if not drop < np.inf:
        return side * np.inf
    scratch = np.zeros((SCRATCH, z.size))
    value, _, _, _, haa, hab, hbb, _, _, _ = evaluate(kind, link, a, b, z, k, n, penalised, scratch)
    if what == FRACTILE:
        best = (eta - a) / b
        free = b
    else:
        best = math.log(b)
        free = a
    if drop < 1e-16:
        return best
    det = haa * hbb - hab * hab
    variance = haa / det / (b * b) if what == SLOPE else (hbb - 2.0 * best * hab + best * best * haa) / det / (b * b)
    # the fractile's place is (eta - a)/b: its variance is the variance of a + best b over b²
    step = math.sqrt(2.0 * drop * variance) if variance > 0.0 else 1.0
    step = side * min(max(step, 1e-12), 1.0)
    inner = best
    outer = best
    fall = 0.0
    slope = 0.0
    for _ in range(400):
        outer = inner + step
        if abs(outer) > (LARGE if what == SLOPE else 1e6):
            return side * np.inf
        top, slope, free = profile(kind, link, z, k, n, penalised, what, eta, outer, free, PRECISE, scratch)
        fall = value - top - drop
        if not fall < 0.0:
            break
        inner = outer
        step *= 1.5
    at = outer
    for _ in range(200):
        # Newton's step on the profile, kept inside the bracket
        new = at + fall / slope if slope != 0.0 else np.nan
        if not (min(inner, outer) < new < max(inner, outer)):
            new = 0.5 * (inner + outer)
        if abs(new - at) <= OF_END * (1.0 + abs(at)) or new in (inner, outer):
            return new
        at = new
        top, slope, free = profile(kind, link, z, k, n, penalised, what, eta, at, free, PRECISE, scratch)
        fall = value - top - drop
        if fall < 0.0:
            inner = at
        else:
            outer = at
    return at


@kernel()
def saturated(kind, k, n):
    """Return the log-likelihood of the observed shares themselves."""
    value = 0.0
    for i in range(k.size):
        total = n[0] if kind == INTERVAL else n[i]
        if k[i] > 0.0:
            value += k[i] * math.log(k[i] / total)
        if kind == BINOMIAL and k[i] < total:
            value += (total - k[i]) * math.log1p(-k[i] / total)
    return value


@kernel()
def constrained(what, eta, at, a, b, haa, hab, hbb):
    """Return the free parameter that maximises the parabola about a fit at (a, b), with the other one at `at`."""
    if what == SLOPE:
        return a + (b - math.exp(at)) * hab / haa
    # on a + b at = eta: the step is along the covariance times (1, at)
    along_a = hbb - hab * at
    along_b = haa * at - hab
    return b - (a + b * at - eta) * along_b / (along_a + along_b * at)


@kernel(keep=True)
def signed_roots(kind, link, z, k, n, fits, always, what, eta, at, free, out):
    """Write the signed roots of twice the drop in log-likelihood of each fit with the parameter held at `at`.

    Roots are positive if the parameter of the fit lies above `at`. `what`, `eta`, `at`: as in `profile`, `free` the
    other parameter there. Fits without a maximum count with their supremum: a perfect fit if separated, a constant
    curve if overturnings do not increase. `always`: all fits are penalised. `out` (replicate,); NaN if a search failed.
    """
    scratch = np.zeros((SCRATCH, z.size))
    for r in range(k.shape[0]):
        status = int(fits[r, STATUS])
        a = fits[r, A]
        b = fits[r, B]
        out[r] = np.nan
        sign = 0.0
        if b > 0.0:
            parameter = math.log(b) if what == SLOPE else (eta - a) / b
            sign = 1.0 if parameter > at else -1.0
        if always:
            if not b > 0.0:
                continue
            top = evaluate(kind, link, a, b, z, k[r], n[r], np.bool_(True), scratch)[0]
        elif status == OK:
            top = fits[r, LOG_LIKELIHOOD]
        elif status in (FAILED, NO_RUNS):
            continue
        else:
            fell = total = 0.0
            if kind == BINOMIAL:
                for i in range(z.size):
                    fell += k[r, i]
                    total += n[r, i]
            else:
                fell = k[r, 0]
                total = k[r, 0] + k[r, z.size]
            if what == SLOPE:
                sign = 1.0 if status == SEPARATED else -1.0
            elif status != SEPARATED:
                sign = 1.0 if fell < total * math.exp(tails(eta, link)[0]) else -1.0
            if status == DECREASING and kind == BINOMIAL:
                top = fell * math.log(fell / total) + (total - fell) * math.log1p(-fell / total)
            else:
                top = saturated(kind, k[r], n[r])
        guess = free
        if b > 0.0:
            guess = constrained(what, eta, at, a, b, fits[r, HAA], fits[r, HAB], fits[r, HBB])
            guess = guess if what == SLOPE or guess > 0.0 else free
        # (with a penalty steps may be shorter than Newton's: the gain of the last step is then not the parabola's)
        tolerance = PRECISE if always else VALUE_ONLY
        value, _, _ = profile(kind, link, z, k[r], n[r], always, what, eta, at, guess, tolerance, scratch)
        out[r] = sign * math.sqrt(max(2.0 * (top - value), 0.0))
