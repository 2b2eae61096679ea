"""Compiled maximum likelihood of normal distributions and trends of interval-censored values.

A value y of N(location + x slope, dispersion²) lies between `lower` and `upper`, either of which may be infinite. With
gamma = 1/dispersion and beta = gamma (location, slopes) the log-likelihood is sum w ln(Phi(gamma upper - x beta) -
Phi(gamma lower - x beta)). It is concave (Burridge 1981), so that Newton's steps with halving find its maximum. Data of
half-lines alone (overturned below y, not overturned above it) make a probit regression.
"""

import math

import numpy as np

from ...core.compiled import kernel

OK = 0
NONE = 1
ALL = 2
SEPARATED = 3
DECREASING = 4
FAILED = 5

MAX_ITERATIONS = 60
MAX_HALVINGS = 40
ROOT_HALF = math.sqrt(0.5)
DENSITY = 1.0 / math.sqrt(2.0 * math.pi)
# A probability below this value means that the step was too long.
LEAST = 1e-280
SINGULAR = 1e-13
# Ends nearer than this share of the spread are one: a level that was converted may differ in last digits.
SAME = 1e-9


@kernel(error_model="python")
def _between(a, b):
    """Return Phi(b) - Phi(a), a < b, computed from the tail in which both lie."""
    if a > 0.0:
        return 0.5 * (math.erfc(a * ROOT_HALF) - math.erfc(b * ROOT_HALF))
    return 0.5 * (math.erfc(-b * ROOT_HALF) - math.erfc(-a * ROOT_HALF))


@kernel(error_model="python")
def _likelihood(theta, lower, upper, design, weights, gradient, information):
    """Return the log-likelihood at theta = (gamma, beta), -inf if undefined; fill gradient and observed information."""
    gamma = theta[0]
    k = design.shape[1]
    value = 0.0
    gradient[:] = 0.0
    information[:] = 0.0
    for i in range(lower.size):
        w = weights[i]
        if w == 0.0:
            continue
        shift = 0.0
        for j in range(k):
            shift += theta[1 + j] * design[i, j]
        a, b = -math.inf, math.inf
        # zero times an infinite end, as the limit
        low, high, at_low, at_high = 0.0, 0.0, 0.0, 0.0
        if lower[i] > -math.inf:
            low = lower[i]
            a = gamma * low - shift
            at_low = DENSITY * math.exp(-0.5 * a * a)
        if upper[i] < math.inf:
            high = upper[i]
            b = gamma * high - shift
            at_high = DENSITY * math.exp(-0.5 * b * b)
        if not a < b:
            return -math.inf
        p = _between(a, b)
        if not p > LEAST:
            return -math.inf
        at_low /= p
        at_high /= p
        value += w * math.log(p)
        bend_low = 0.0 if a == -math.inf else a * at_low
        bend_high = 0.0 if b == math.inf else b * at_high
        slope = at_high * high - at_low * low
        down = at_low - at_high
        gradient[0] += w * slope
        information[0, 0] += w * (bend_high * high * high - bend_low * low * low + slope * slope)
        mixed = w * (bend_low * low - bend_high * high + slope * down)
        curvature = w * (bend_high - bend_low + down * down)
        for j in range(k):
            x = design[i, j]
            gradient[1 + j] += w * down * x
            information[0, 1 + j] += mixed * x
            for m in range(j + 1):
                information[1 + j, 1 + m] += curvature * x * design[i, m]
    for j in range(k):
        information[1 + j, 0] = information[0, 1 + j]
        for m in range(j):
            information[1 + m, 1 + j] = information[1 + j, 1 + m]
    return value


@kernel(error_model="python")
def _solve(matrix, right, solution, work):
    """Solve a small positive definite system by Cholesky's factors in `work`; return False if it is singular."""
    n = right.size
    for i in range(n):
        for j in range(i + 1):
            total = matrix[i, j]
            for m in range(j):
                total -= work[i, m] * work[j, m]
            if i == j:
                if not total > SINGULAR * matrix[i, i]:
                    return False
                work[i, i] = math.sqrt(total)
            else:
                work[i, j] = total / work[j, j]
    for i in range(n):
        total = right[i]
        for m in range(i):
            total -= work[i, m] * solution[m]
        solution[i] = total / work[i, i]
    for i in range(n - 1, -1, -1):
        total = solution[i]
        for m in range(i + 1, n):
            total -= work[m, i] * solution[m]
        solution[i] = total / work[i, i]
    return True


@kernel(error_model="python")
def _existence(lower, upper, weights):
    """Return OK if a finite maximum with gamma > 0 is possible: the intervals must have no point in common."""
    last_start, first_end = -math.inf, math.inf
    first_stood, last_fell = math.inf, -math.inf
    closed = False
    for i in range(lower.size):
        if weights[i] == 0.0:
            continue
        bounded_below, bounded_above = lower[i] > -math.inf, upper[i] < math.inf
        if bounded_below:
            last_start = max(last_start, lower[i])
        if bounded_above:
            first_end = min(first_end, upper[i])
        if bounded_below and bounded_above:
            closed = True
        elif bounded_below:
            first_stood = min(first_stood, lower[i])
        elif bounded_above:
            last_fell = max(last_fell, upper[i])
    if first_end == math.inf:
        return NONE
    if last_start == -math.inf:
        return ALL
    if last_start <= first_end + SAME:
        return SEPARATED
    if not closed and first_stood >= last_fell - SAME:
        return DECREASING
    return OK


@kernel(error_model="python")
def _maximise(theta, lower, upper, design, weights, tolerance, value, gradient, information):
    """Take Newton's steps from theta, in place, until one is shorter than `tolerance` standard errors; return a status.

    `value`, `gradient` and `information` belong to the likelihood at theta; gradient and information are updated in
    place to their values before the last step.
    """
    n = theta.size
    step, trial, work = np.empty(n), np.empty(n), np.empty((n, n))
    trial_gradient, trial_information = np.empty(n), np.empty((n, n))
    if not value > -math.inf:
        return FAILED
    for _ in range(MAX_ITERATIONS):
        if not _solve(information, gradient, step, work):
            return FAILED
        decrement = 0.0
        for j in range(n):
            decrement += step[j] * gradient[j]
        if decrement <= tolerance * tolerance:
            theta += step
            return OK if theta[0] > 0.0 else DECREASING
        better = False
        for _halving in range(MAX_HALVINGS):
            for j in range(n):
                trial[j] = theta[j] + step[j]
            new = _likelihood(trial, lower, upper, design, weights, trial_gradient, trial_information)
            if new >= value - 1e-12 * abs(value):
                better = True
                break
            for j in range(n):
                step[j] *= 0.5
        if not better:
            return FAILED
        theta[:] = trial
        gradient[:] = trial_gradient
        information[:] = trial_information
        value = new
    return FAILED


@kernel(error_model="python")
def _contributions(theta, lower, upper, design):
    """Parts (n, 6) of each interval in value, gradient (2) and information (00, 01, 11) at theta = (gamma, beta)."""
    parts = np.empty((lower.size, 6))
    weight, gradient, information = np.ones(1), np.empty(2), np.empty((2, 2))
    for i in range(lower.size):
        row = slice(i, i + 1)
        parts[i, 0] = _likelihood(theta, lower[row], upper[row], design[row], weight, gradient, information)
        parts[i, 1:3] = gradient
        parts[i, 3:5] = information[0]
        parts[i, 5] = information[1, 1]
    return parts


@kernel(error_model="python")
def _frame(lower, upper):
    """Return centre and spread of the finite ends, in whose units the parameters are of order one."""
    total, squares, count = 0.0, 0.0, 0
    for i in range(lower.size):
        for end in (lower[i], upper[i]):
            if abs(end) < math.inf:
                total += end
                count += 1
    if count == 0:
        return 0.0, 1.0
    centre = total / count
    for i in range(lower.size):
        for end in (lower[i], upper[i]):
            if abs(end) < math.inf:
                squares += (end - centre) * (end - centre)
    spread = math.sqrt(squares / count)
    return centre, spread if spread > 0.0 else 1.0


@kernel(keep=True, error_model="python")
def fit_rows(lower, upper, weights, tolerance, location, dispersion, status):
    """Fit location and dispersion of every row of intervals (m, n) under every row of weights (b, n), into (m, b).

    The first weights belong to the data themselves, whose fit converges to rounding and starts the others; `tolerance`,
    in standard errors, applies to the other fits.
    """
    n = lower.shape[1]
    design = np.ones((n, 1))
    first, theta, sums = np.empty(2), np.empty(2), np.empty(6)
    gradient, information = np.empty(2), np.empty((2, 2))
    for row in range(lower.shape[0]):
        centre, spread = _frame(lower[row], upper[row])
        low, high = (lower[row] - centre) / spread, (upper[row] - centre) / spread
        first[:] = (1.0, 0.0)
        start = _contributions(first, low, high, design)
        for b in range(weights.shape[0]):
            location[row, b] = np.nan
            dispersion[row, b] = np.nan
            result = _existence(low, high, weights[b])
            if result == OK:
                theta[:] = first
                sums[:] = 0.0
                for j in range(start.shape[0]):
                    for k in range(sums.size):
                        sums[k] += weights[b, j] * start[j, k]
                gradient[:] = sums[1:3]
                information[0] = sums[3:5]
                information[1] = sums[4:6]
                limit = 1e-6 if b == 0 else tolerance
                result = _maximise(theta, low, high, design, weights[b], limit, sums[0], gradient, information)
            status[row, b] = result
            if result == OK:
                if b == 0:
                    first[:] = theta
                    start = _contributions(first, low, high, design)
                location[row, b] = centre + spread * theta[1] / theta[0]
                dispersion[row, b] = spread / theta[0]


@kernel(keep=True, error_model="python")
def fit_trends(lower, upper, covariate, slope, error, status):
    """Fit the slope of every row of intervals (m, n) on a covariate (n,) and its standard error, into (m,).

    The error is from the observed information times sqrt(n/(n - 2)): for values known exactly, slope and error are as
    from ordinary least squares.
    """
    n = lower.shape[1]
    mean, deviation = covariate.mean(), covariate.std()
    design = np.ones((n, 2))
    weights = np.ones(n)
    theta, step, direction = np.empty(3), np.empty(3), np.empty(3)
    gradient, information, work = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    for row in range(lower.shape[0]):
        slope[row] = np.nan
        error[row] = np.nan
        status[row] = FAILED
        if n < 3 or not deviation > 1e-9 * max(1.0, abs(mean)):
            continue
        design[:, 1] = (covariate - mean) / deviation
        centre, spread = _frame(lower[row], upper[row])
        low, high = (lower[row] - centre) / spread, (upper[row] - centre) / spread
        result = _existence(low, high, weights)
        if result == OK:
            theta[:] = (1.0, 0.0, 0.0)
            value = _likelihood(theta, low, high, design, weights, gradient, information)
            result = _maximise(theta, low, high, design, weights, 1e-6, value, gradient, information)
        status[row] = result
        if result != OK:
            continue
        # of beta_1/gamma
        direction[:] = (-theta[2] / (theta[0] * theta[0]), 0.0, 1.0 / theta[0])
        if not _solve(information, direction, step, work):
            status[row] = FAILED
            continue
        variance = 0.0
        for j in range(3):
            variance += direction[j] * step[j]
        slope[row] = spread * theta[2] / theta[0] / deviation
        error[row] = spread * math.sqrt(variance * n / (n - 2.0)) / deviation
