// SPDX-License-Identifier: Apache-2.0
#include "shading/rough_interface.h"

#include "base/tasks.h"
#include "shading/ggx.h"
#include "shading/lattice.h"

#include <algorithm>
#include <cmath>

namespace velatura::shading {

namespace rough_interface {

namespace {

double schlick(double cosine) {
    const double m = 1.0 - cosine, m2 = m * m;
    return m2 * m2 * m;
}

}  // namespace

float refraction_weight(float cos_o, float cos_i, float alpha) {
    // G1 grows with the cosine: the smaller one masks
    return cos_i >= cos_o ? 1.0f : ggx_g1(cos_i, alpha) / ggx_g1(cos_o, alpha);
}

float refraction_weight(const Vec3& wo, const Vec3& wi, const Vec2& alpha) {
    return std::min(ggx_g1(wi, alpha) / ggx_g1(wo, alpha), 1.0f);
}

namespace {

/// Isotropic facets are mirrored about wo: half of the azimuths are enough.
constexpr double isotropic_part = 0.5;

template <class Alpha>
SharesOf<double> shares_on(
    const std::vector<Vec2d>& turns, const Vec3d& wo, const Alpha& alpha, double index, Side side) {
    const double count = double(turns.size());
    const double eta = side == Side::Dense ? 1.0 / index : index;
    const double g1_o = ggx_g1(wo, alpha);
    const double reflected_scale = 4.0 * wo.z / g1_o;
    SharesOf<double> sum;
    for (size_t i = 0; i < turns.size(); ++i) {
        const Vec3d wm = ggx_sample_normal(wo, alpha, turns[i], (double(i) + 0.5) / count);
        const double c = wo.dot(wm);
        if (!(c > 0.0)) continue;
        const double cos2_t = 1.0 - (1.0 - c * c) / (eta * eta);
        double weight = 1.0, passed = 0.0;
        if (cos2_t > 0.0) {
            const double cos_t = std::sqrt(cos2_t);
            weight = schlick(side == Side::Dense ? cos_t : std::min(c, 1.0));
            const Vec3d wi = wm * (c / eta - cos_t) - wo / eta;
            const Vec3d mirrored(wi.x, wi.y, -wi.z);
            if (wi.z < 0.0) passed = std::min(1.0, ggx_g1(mirrored, alpha) / g1_o) * (1.0 - weight);
        }
        const Vec3d wi = wm * (2.0 * c) - wo;
        double reflected = 0.0;
        // G2 / G1(wo) = 4·μo·visibility / G1(wo) · μi, height-correlated
        if (wi.z > 0.0) reflected = reflected_scale * wi.z * ggx_visibility(wo, wi, alpha);
        sum.passed += passed;
        sum.excess += 1.0 - weight * reflected - passed;
    }
    return {sum.passed / count, sum.excess / count};
}

Vec3d direction_with(double mu) {
    return {std::sqrt(std::max(0.0, 1.0 - mu * mu)), 0.0, mu};
}

}  // namespace

SharesOf<double> exact_shares(double mu, double alpha, double index, Side side, int count) {
    return shares_on(lattice_turns(count, isotropic_part), direction_with(mu), alpha, index, side);
}

CosineAxis::CosineAxis(double alpha_in, double index, Side side) : alpha(alpha_in) {
    if (side == Side::Light) return;
    critical = std::sqrt((index - 1.0) * (index + 1.0)) / index;
    width = 0.5 * alpha / index;
    begin = std::asinh(-critical / width);
    scale = 1.0 / (std::asinh((1.0 - critical) / width) - begin);
}

double CosineAxis::position(double mu) const {
    // As the axis of the albedo tables (albedo.h)
    const double rest = alpha * (1.0 - mu) / (mu + alpha);
    const double grazing = std::sqrt(1.0 - std::sqrt(std::max(rest, 0.0)));
    if (critical < 0.0) return grazing;
    const double around = (std::asinh((mu - critical) / width) - begin) * scale;
    return 0.4 * grazing + 0.6 * around;
}

double CosineAxis::cosine(double at) const {
    double low = 0.0, high = 1.0;
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        (position(middle) < at ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

}  // namespace rough_interface

using namespace rough_interface;

namespace {

constexpr int node_count = 64;
constexpr int max_rows = 33;
constexpr int max_average_rows = 257;
constexpr int quadrature_points = 1597;
constexpr int anisotropic_rows = 17;
constexpr int anisotropic_points = 987;

Shares mix(const Shares& a, const Shares& b, float t) {
    return {a.passed + (b.passed - a.passed) * t, a.excess + (b.excess - a.excess) * t};
}

Shares at_position(const Shares* nodes, double position) {
    const double scaled = std::clamp(position, 0.0, 1.0) * (node_count - 1);
    const int i = std::min(int(scaled), node_count - 2);
    return mix(nodes[i], nodes[i + 1], float(scaled - double(i)));
}

double larger_index(float ior) {
    return ior > 1.0f ? double(ior) : 1.0 / double(ior);
}

}  // namespace

RoughInterface::RoughInterface(float ior, float alpha_low, float alpha_high)
    : ior_(ior),
      alpha_low_(alpha_low),
      alpha_high_(alpha_high),
      root_low_(std::sqrt(alpha_low)),
      root_high_(std::sqrt(alpha_high)),
      row_count_(alpha_low < alpha_high ? max_rows : 1),
      average_count_(alpha_low < alpha_high ? max_average_rows : 1) {
    const double index = larger_index(ior);
    const std::vector<Vec2d> turns = lattice_turns(quadrature_points, isotropic_part);
    shares_.resize(size_t(2 * row_count_ * node_count));
    averages_.resize(size_t(2 * average_count_));
    for (const Side side : {Side::Light, Side::Dense}) {
        for (int row = 0; row < row_count_; ++row) {
            const double alpha = alpha_at(row, row_count_);
            const CosineAxis axis(alpha, index, side);
            Shares* nodes = &shares_[size_t((int(side) * row_count_ + row) * node_count)];
            for (int i = 0; i < node_count; ++i) {
                const double mu = std::max(axis.cosine(double(i) / (node_count - 1)), 1e-9);
                const SharesOf<double> s = shares_on(turns, direction_with(mu), alpha, index, side);
                nodes[i] = {float(s.passed), float(s.excess)};
            }
        }
        for (int row = 0; row < average_count_; ++row) {
            const float alpha = float(alpha_at(row, average_count_));
            averages_[size_t(int(side) * average_count_ + row)] = mean_of(curve(alpha, side));
        }
    }
}

RoughInterface::RoughInterface(float ior, const Vec2& alpha, const AnisotropicAlbedo* reflected)
    : anisotropic_(reflected),
      reflected_(reflected->curve(alpha)),
      alpha_(alpha),
      ior_(ior),
      alpha_low_(alpha.y),
      alpha_high_(alpha.x),
      root_low_(std::sqrt(alpha.y)),
      root_high_(std::sqrt(alpha.x)),
      row_count_(anisotropic_rows),
      average_count_(1) {
    const std::vector<Vec2d> turns = lattice_turns(anisotropic_points);
    shares_.resize(size_t(2 * row_count_ * node_count));
    parallel_for(size_t(2 * row_count_), [&](size_t k) {
        const Side side = k < size_t(row_count_) ? Side::Light : Side::Dense;
        const double along = alpha_at(int(k) % row_count_, row_count_);
        const CosineAxis axis(along, larger_index(ior_), side);
        for (int i = 0; i < node_count; ++i) {
            const double mu = std::max(axis.cosine(double(i) / (node_count - 1)), 1e-9);
            const Vec3d wo = anisotropy_detail::direction_with(mu, along, Vec2d(alpha_));
            const SharesOf<double> s =
                shares_on(turns, wo, Vec2d(alpha_), larger_index(ior_), side);
            shares_[k * node_count + size_t(i)] = {float(s.passed), float(s.excess)};
        }
    });
    averages_.resize(2);
    for (const Side side : {Side::Light, Side::Dense})
        averages_[size_t(side)] = anisotropic_mean(side);
}

double RoughInterface::alpha_at(int row, int count) const {
    const double t = count > 1 ? double(row) / (count - 1) : 0.0;
    const double root = double(root_low_) + (double(root_high_) - double(root_low_)) * t;
    return root * root;
}

RoughInterface::Axis RoughInterface::axis_at(float alpha, int count) const {
    if (count == 1) return {};
    const float x = (std::sqrt(alpha) - root_low_) / (root_high_ - root_low_);
    const float scaled = std::clamp(x, 0.0f, 1.0f) * float(count - 1);
    const int row = std::min(int(scaled), count - 2);
    return {row, row + 1, scaled - float(row)};
}

RoughInterface::Curve RoughInterface::curve(float alpha, Side side) const {
    Curve c;
    if (anisotropic_) {
        c.low_ = &shares_[size_t(int(side) * row_count_ * node_count)];
        c.average_ = averages_[size_t(side)];
        c.anisotropic_ = this;
        c.side_ = side;
        return c;
    }
    const Axis rows = axis_at(alpha, row_count_), means = axis_at(alpha, average_count_);
    const int first = int(side) * row_count_, first_mean = int(side) * average_count_;
    c.low_ = &shares_[size_t((first + rows.row) * node_count)];
    c.high_ = &shares_[size_t((first + rows.next) * node_count)];
    c.t_ = rows.t;
    c.average_ = mix(averages_[size_t(first_mean + means.row)],
                     averages_[size_t(first_mean + means.next)], means.t);
    c.axis_ = CosineAxis(double(alpha), larger_index(ior_), side);
    c.is_light_ = side == Side::Light;
    if (c.is_light_) c.reflected_ = GgxAlbedoCurve(alpha);
    return c;
}

/// Means with weight 2μ of the shares as they are interpolated, so that what they bring back is
/// exact.
Shares RoughInterface::mean_of(const Curve& curve) {
    constexpr int count = 1024;
    double passed = 0.0, excess = 0.0;
    for (int i = 0; i < count; ++i) {
        // Substitute μ = s³, to resolve grazing angles
        const double s = (i + 0.5) / count, mu = s * s * s;
        const Shares at = curve.at(float(mu));
        const double weight = 2.0 * mu * 3.0 * s * s / count;
        passed += weight * double(at.passed);
        excess += weight * double(at.excess);
    }
    return {float(passed), float(excess)};
}

Shares RoughInterface::anisotropic_mean(Side side) const {
    constexpr int mu_steps = 256, phi_steps = 16;
    const Curve c = curve(0.0f, side);
    double passed = 0.0, excess = 0.0;
    for (int i = 0; i < mu_steps; ++i) {
        const double s = (i + 0.5) / mu_steps, mu = s * s * s, sine = std::sqrt(1.0 - mu * mu);
        for (int j = 0; j < phi_steps; ++j) {
            const double v = (j + 0.5) / phi_steps, rest = 0.5 * pi_d * v * v * v;
            const double weight = 6.0 * s * s * mu / mu_steps * (3.0 * v * v / phi_steps);
            const Shares at =
                c.at(to_float(Vec3d(sine * std::sin(rest), sine * std::cos(rest), mu)));
            passed += weight * double(at.passed);
            excess += weight * double(at.excess);
        }
    }
    return {float(passed), float(excess)};
}

/// Rows and nodes as the tables were made.
Shares RoughInterface::Curve::at_direction(const Vec3& w) const {
    const RoughInterface& table = *anisotropic_;
    const float along = anisotropy_detail::alpha_along(w, table.alpha_);
    const Axis row = table.axis_at(along, table.row_count_);
    const CosineAxis axis(double(along), larger_index(table.ior_), side_);
    const double position = axis.position(double(std::clamp(w.z, 0.0f, 1.0f)));
    Shares s = mix(at_position(low_ + row.row * node_count, position),
                   at_position(low_ + row.next * node_count, position), row.t);
    if (side_ == Side::Light) {
        s.passed = std::max(1.0f - table.reflected_.at(w).schlick - s.excess, 0.0f);
    }
    return s;
}

Shares RoughInterface::Curve::at(float mu) const {
    const double position = axis_.position(double(mu));
    Shares s = mix(at_position(low_, position), at_position(high_, position), t_);
    if (is_light_) s.passed = std::max(1.0f - reflected_.at(mu).schlick - s.excess, 0.0f);
    return s;
}

}  // namespace velatura::shading
