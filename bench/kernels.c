/* The loops of three filters as a C programmer would write them: the peer of bench_kernels.py.
   Columns are the corrected samples' dt, angle and rate; tilt and rate are written, and the
   bias and variance where the filter has them. */
#include <stddef.h>

void complementary(size_t n, const double *dt, const double *angle, const double *rate,
                   const double *p, double *out) {
    double tilt = angle[0];
    for (size_t i = 1; i < n; i++) {
        double weight = p[0] / (dt[i] + p[0]);
        tilt = weight * (tilt + dt[i] * rate[i]) + (1.0 - weight) * angle[i];
        out[i] = tilt;
        out[n + i] = rate[i];
    }
}

void alpha_beta_wb(size_t n, const double *dt, const double *angle, const double *rate,
                   const double *p, double *out) {
    double tilt = angle[0], bias = 0.0;
    for (size_t i = 1; i < n; i++) {
        double predicted = tilt + (rate[i - 1] - bias) * dt[i];
        double residual = angle[i] - predicted;
        bias += p[1] * residual;
        tilt = predicted + p[0] * residual;
        out[i] = tilt;
        out[n + i] = rate[i] - bias;
        out[2 * n + i] = bias;
    }
}

void kalman(size_t n, const double *dt, const double *angle, const double *rate,
            const double *p, double *out) {
    double q1 = p[0], q2 = p[1], r = p[2];
    double tilt = angle[0], bias = 0.0, p11 = r, p12 = 0.0, p22 = 0.0;
    for (size_t i = 1; i < n; i++) {
        double t = dt[i];
        p11 = p11 + t * (t * p22 - 2.0 * p12) + q1 * t * t;
        p12 = p12 - t * p22;
        p22 = p22 + q2;
        double predicted = tilt + t * (rate[i - 1] - bias);
        double s = p11 + r, k1 = p11 / s, k2 = p12 / s;
        double residual = angle[i] - predicted;
        bias += k2 * residual;
        tilt = predicted + k1 * residual;
        p22 -= k2 * p12;
        p11 *= 1.0 - k1;
        p12 *= 1.0 - k1;
        out[i] = tilt;
        out[n + i] = rate[i] - bias;
        out[2 * n + i] = bias;
        out[3 * n + i] = p11;
    }
}
