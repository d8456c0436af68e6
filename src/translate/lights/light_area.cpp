// SPDX-License-Identifier: Apache-2.0
#include "translate/lights/light_area.h"

#include <Imath/ImathMatrixAlgo.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace velatura::translate::lights {

namespace {

Vec3d row(const Mat4d& m, int i) {
    return {m[i][0], m[i][1], m[i][2]};
}

/// Carlson's R_F and R_D by duplication, arguments of order 1.
double carlson_rf(double x, double y, double z) {
    for (int i = 0; i < 60; ++i) {
        const double lambda = std::sqrt(x * y) + std::sqrt(y * z) + std::sqrt(z * x);
        x = (x + lambda) / 4;
        y = (y + lambda) / 4;
        z = (z + lambda) / 4;
    }
    return 1.0 / std::sqrt((x + y + z) / 3);
}

double carlson_rd(double x, double y, double z) {
    double sum = 0, factor = 1;
    for (int i = 0; i < 60; ++i) {
        const double lambda = std::sqrt(x * y) + std::sqrt(y * z) + std::sqrt(z * x);
        sum += factor / (std::sqrt(z) * (z + lambda));
        factor /= 4;
        x = (x + lambda) / 4;
        y = (y + lambda) / 4;
        z = (z + lambda) / 4;
    }
    const double mean = (x + y + 3 * z) / 5;
    return 3 * sum + factor / (mean * std::sqrt(mean));
}

/// R_G of arguments of any size; exact under scaling by even powers of two.
double carlson_rg(double x, double y, double z) {
    if (x > y) std::swap(x, y);
    if (y > z) std::swap(y, z);
    if (x > y) std::swap(x, y);
    if (z <= 0.0) return 0.0;
    int exponent = 0;
    std::frexp(z, &exponent);
    exponent &= ~1;
    x = std::ldexp(x, -exponent);
    y = std::ldexp(y, -exponent);
    z = std::ldexp(z, -exponent);
    // Two arguments gone: a segment seen from both sides
    const double g = y <= 0.0
                         ? std::sqrt(z) / 2
                         : (y * carlson_rf(x, z, y) - (x - y) * (z - y) * carlson_rd(x, z, y) / 3 +
                            std::sqrt(x * z / y)) /
                               2;
    return std::ldexp(g, exponent / 2);
}

}  // namespace

double rect_area(double width, double height, const Mat4d& m) {
    return (row(m, 0) * width).cross(row(m, 1) * height).length();
}

double disk_area(double radius, const Mat4d& m) {
    return pi_d * (row(m, 0) * radius).cross(row(m, 1) * radius).length();
}

double sphere_area(double radius, const Mat4d& m) {
    // Eigenvalues of C·Cᵀ, C the cofactors, are the squared products of two semi-axes
    Mat3d c = cofactor_matrix(m) * (radius * radius);
    double largest = 0;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) largest = std::max(largest, std::abs(c[i][j]));
    if (!(largest > 0.0)) return 0.0;
    int exponent = 0;
    std::frexp(largest, &exponent);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) c[i][j] = std::ldexp(c[i][j], -exponent);
    Mat3d gram = c * c.transposed();
    Vec3d squares;
    Mat3d vectors;
    Imath::jacobiEigenSolver(gram, squares, vectors);
    for (int i = 0; i < 3; ++i) squares[i] = std::max(squares[i], 0.0);
    return std::ldexp(4 * pi_d * carlson_rg(squares.x, squares.y, squares.z), exponent);
}

double cylinder_area(double radius, double length, const Mat4d& m) {
    // ∮ |cosθ·A + sinθ·B| dθ is the perimeter of an ellipse with conjugate half diameters A and B
    const Vec3d x = row(m, 0) * length;
    const Vec3d a = x.cross(row(m, 1) * radius), b = x.cross(row(m, 2) * radius);
    const double sum = a.dot(a) + b.dot(b), product = a.cross(b).length();
    const double root = safe_sqrt((sum - 2 * product) * (sum + 2 * product));
    const double major = (sum + root) / 2;
    const double minor = major > 0.0 ? product * product / major : 0.0;
    return 8 * carlson_rg(0.0, minor, major);
}

double distant_divisor(double angle_deg) {
    if (angle_deg <= 0.0) return 1.0;
    const double t = std::min(angle_deg, 360.0) * pi_d / 360.0;
    const double s = std::sin(t);
    return t <= pi_d / 2 ? pi_d * s * s : pi_d * (2 - s * s);
}

}  // namespace velatura::translate::lights
