// SPDX-License-Identifier: Apache-2.0
#include "shading/anisotropic_albedo.h"

#include "base/tasks.h"
#include "shading/fresnel.h"
#include "shading/ggx.h"
#include "shading/lattice.h"

#include <algorithm>
#include <cmath>

namespace velatura::shading {

namespace {

float root_ratio(const Vec2& alpha) {
    return std::sqrt(alpha.y / alpha.x);
}

/// Axis of cosines as in albedo.h, for the width in the plane of the direction.
float node_position(float mu, float along) {
    return safe_sqrt(1.0f - safe_sqrt(along * (1.0f - mu) / (mu + along)));
}

double cosine_at(double position, double along) {
    const double rest = (1.0 - position * position) * (1.0 - position * position);
    return std::max(along * (1.0 - rest) / (along + rest), 1e-9);
}

}  // namespace

Vec2 anisotropic_alpha(float roughness, float anisotropy) {
    const float ratio = 1.0f - anisotropy;
    const float x = roughness * roughness * std::sqrt(2.0f / (1.0f + ratio * ratio));
    return {x, std::max(x * ratio, min_alpha)};
}

Vec3d anisotropy_detail::direction_with(double mu, double along, const Vec2d& alpha) {
    const double x2 = alpha.x * alpha.x, y2 = alpha.y * alpha.y;
    const double cos2 = x2 > y2 ? std::clamp((along * along - y2) / (x2 - y2), 0.0, 1.0) : 1.0;
    const double sine = std::sqrt(std::max(0.0, 1.0 - mu * mu));
    return {sine * std::sqrt(cos2), sine * std::sqrt(1.0 - cos2), mu};
}

namespace {

struct ExactGgxAlbedo {
    double loss = 0, schlick = 0;  ///< as in GgxAlbedo
};

/// By quadrature over the directions that bounded visible normals reflect to. turns: the lattice.
/// wo in the frame of the widths, unit, z > 0.
ExactGgxAlbedo albedo_on(const std::vector<Vec2d>& turns, const Vec3d& wo, const Vec2d& alpha) {
    const double count = double(turns.size());
    const double divisor = ggx_pdf_divisor(wo, alpha);
    const Vec3d o = ggx_detail::stretched(wo, alpha);
    const double bound = ggx_detail::cap_bound(wo, alpha) * o.z;
    const double length_o = ggx_detail::stretched_length(wo, alpha);
    double one = 0.0, schlick = 0.0;
    for (size_t i = 0; i < turns.size(); ++i) {
        const Vec3d m =
            ggx_detail::cap_normal(o, bound, alpha, turns[i], (double(i) + 0.5) / count);
        const double facing = wo.dot(m), length2 = m.dot(m);
        if (!(length2 > 0.0)) continue;
        const Vec3d wi = m * (2.0 * facing / length2) - wo;
        if (!(wi.z > 0.0)) continue;
        // ggx_visibility, with what belongs to wo taken out of the loop
        const double length_i = ggx_detail::stretched_length(wi, alpha);
        const double weight = 0.5 * divisor * wi.z / (wi.z * length_o + wo.z * length_i);
        const double k = std::max(1.0 - facing / std::sqrt(length2), 0.0), k2 = k * k;
        one += weight;
        schlick += weight * k2 * k2 * k;
    }
    return {1.0 - one / count, schlick / count};
}

}  // namespace

AnisotropicAlbedo::AnisotropicAlbedo(const AnisotropyRange& range) : range_(range) {
    const bool varies_alpha = range.alpha_low < range.alpha_high;
    const bool varies_ratio = range.ratio_low < range.ratio_high;
    const bool varies = varies_alpha || varies_ratio;
    alpha_count_ = varies_alpha ? 21 : 1;
    ratio_count_ = varies_ratio ? 11 : 1;
    row_count_ = varies ? 17 : 33;
    node_count_ = varies ? 32 : 64;
    average_alpha_count_ = varies_alpha ? 4 * (alpha_count_ - 1) + 1 : 1;
    average_ratio_count_ = varies_ratio ? 2 * (ratio_count_ - 1) + 1 : 1;
    nodes_.resize(size_t(alpha_count_ * ratio_count_ * row_count_ * node_count_));
    parallel_for(size_t(alpha_count_ * ratio_count_ * row_count_),
                 [&](size_t k) { make_row(int(k) / row_count_, int(k) % row_count_); });
    averages_.resize(size_t(average_alpha_count_ * average_ratio_count_));
    parallel_for(averages_.size(), [&](size_t k) {
        // Means with weight 2μ of the tables as they are interpolated, so that what compensation
        // brings back is exact
        constexpr int mu_steps = 192, phi_steps = 24;
        const Vec2 alpha = alpha_at(int(k) / average_ratio_count_, int(k) % average_ratio_count_,
                                    average_alpha_count_, average_ratio_count_);
        const Curve c = curve_without_average(alpha, {std::sqrt(alpha.x), root_ratio(alpha)});
        double loss = 0.0, schlick = 0.0;
        for (int i = 0; i < mu_steps; ++i) {
            // Substitute μ = s³, to resolve grazing angles
            const double s = (i + 0.5) / mu_steps, mu = s * s * s;
            const double sine = std::sqrt(1.0 - mu * mu);
            for (int j = 0; j < phi_steps; ++j) {
                // Narrow widths are met close to φ = π/2
                const double v = (j + 0.5) / phi_steps;
                const double rest = 0.5 * pi_d * v * v * v;
                const double weight = 6.0 * s * s * mu / mu_steps * (3.0 * v * v / phi_steps);
                const GgxAlbedo a =
                    c.at(to_float(Vec3d(sine * std::sin(rest), sine * std::cos(rest), mu)));
                loss += weight * double(a.loss);
                schlick += weight * double(a.schlick);
            }
        }
        averages_[k] = {float(loss / (double(alpha.x) * double(alpha.x))), float(schlick)};
    });
}

/// The widths of one step of the ranges, equal steps of √αx and of the root of the ratio.
Vec2 AnisotropicAlbedo::alpha_at(int i, int j, int alpha_count, int ratio_count) const {
    const auto squared = [](float low, float high, int k, int count) {
        const float t = count > 1 ? float(k) / float(count - 1) : 0.0f;
        const float root = std::sqrt(low) + (std::sqrt(high) - std::sqrt(low)) * t;
        return root * root;
    };
    const float x = squared(range_.alpha_low, range_.alpha_high, i, alpha_count);
    const float ratio = squared(range_.ratio_low, range_.ratio_high, j, ratio_count);
    return {x, std::min(std::max(x * ratio, min_alpha), x)};
}

void AnisotropicAlbedo::make_row(int table, int row) {
    // Of the Fibonacci numbers
    const int points = alpha_count_ * ratio_count_ > 1 ? 377 : 4181;
    const std::vector<Vec2d> turns = lattice_turns(points);
    const Vec2d alpha(
        alpha_at(table / ratio_count_, table % ratio_count_, alpha_count_, ratio_count_));
    const double low = std::sqrt(alpha.y), high = std::sqrt(alpha.x);
    const double root = low + (high - low) * row / (row_count_ - 1);
    const double along = root * root;
    Curve::Node* nodes = &nodes_[size_t((table * row_count_ + row) * node_count_)];
    for (int n = 0; n < node_count_; ++n) {
        const double mu = cosine_at(double(n) / (node_count_ - 1), along);
        const Vec3d wo = anisotropy_detail::direction_with(mu, along, alpha);
        const ExactGgxAlbedo e = albedo_on(turns, wo, alpha);
        const double mean = std::pow(e.schlick / (1.0 - e.loss), 0.2);
        nodes[n] = {float(e.loss), float((1.0 - mean) / (mu + along))};
    }
}

AnisotropicAlbedo::Axis AnisotropicAlbedo::axis_at(float x, float low, float high, int count) {
    if (count == 1) return {};
    const float scaled = std::clamp((x - low) / (high - low), 0.0f, 1.0f) * float(count - 1);
    const int index = std::min(int(scaled), count - 2);
    return {index, index + 1, scaled - float(index)};
}

AnisotropicAlbedo::Curve AnisotropicAlbedo::curve_without_average(const Vec2& alpha,
                                                                  const Vec2& position) const {
    const Axis a = axis_at(position.x, std::sqrt(range_.alpha_low), std::sqrt(range_.alpha_high),
                           alpha_count_);
    const Axis r = axis_at(position.y, std::sqrt(range_.ratio_low), std::sqrt(range_.ratio_high),
                           ratio_count_);
    const auto table = [&](int i, int j) {
        return &nodes_[size_t((i * ratio_count_ + j) * row_count_ * node_count_)];
    };
    Curve c;
    c.corners_[0] = table(a.index, r.index);
    c.corners_[1] = table(a.index, r.next);
    c.corners_[2] = table(a.next, r.index);
    c.corners_[3] = table(a.next, r.next);
    c.weights_[0] = (1.0f - a.t) * (1.0f - r.t);
    c.weights_[1] = (1.0f - a.t) * r.t;
    c.weights_[2] = a.t * (1.0f - r.t);
    c.weights_[3] = a.t * r.t;
    c.row_count_ = row_count_;
    c.node_count_ = node_count_;
    c.alpha_ = alpha;
    c.root_low_ = std::sqrt(alpha.y);
    const float span = std::sqrt(alpha.x) - c.root_low_;
    c.rows_per_root_ = span > 0.0f ? float(row_count_ - 1) / span : 0.0f;
    return c;
}

AnisotropicAlbedo::Curve AnisotropicAlbedo::curve(const Vec2& alpha) const {
    const Vec2 position(std::sqrt(alpha.x), root_ratio(alpha));
    Curve c = curve_without_average(alpha, position);
    const Axis a = axis_at(position.x, std::sqrt(range_.alpha_low), std::sqrt(range_.alpha_high),
                           average_alpha_count_);
    const Axis r = axis_at(position.y, std::sqrt(range_.ratio_low), std::sqrt(range_.ratio_high),
                           average_ratio_count_);
    const auto mean = [&](int i, int j) { return averages_[size_t(i * average_ratio_count_ + j)]; };
    const auto mix = [](const GgxAlbedo& p, const GgxAlbedo& q, float t) {
        return GgxAlbedo{p.loss + (q.loss - p.loss) * t, p.schlick + (q.schlick - p.schlick) * t};
    };
    c.average_ = mix(mix(mean(a.index, r.index), mean(a.index, r.next), r.t),
                     mix(mean(a.next, r.index), mean(a.next, r.next), r.t), a.t);
    c.average_.loss *= alpha.x * alpha.x;
    return c;
}

GgxAlbedo AnisotropicAlbedo::Curve::at(const Vec3& w) const {
    const float mu = std::clamp(w.z, 0.0f, 1.0f);
    const float along = anisotropy_detail::alpha_along(w, alpha_);
    const float row =
        std::clamp((std::sqrt(along) - root_low_) * rows_per_root_, 0.0f, float(row_count_ - 1));
    const int i = std::min(int(row), row_count_ - 2);
    const float node = node_position(mu, along) * float(node_count_ - 1);
    const int n = std::min(int(node), node_count_ - 2);
    const float s = row - float(i), t = node - float(n);
    Node sum;
    for (int k = 0; k < 4; ++k) {
        if (weights_[k] == 0.0f) continue;
        const Node* p = corners_[k] + i * node_count_ + n;
        const Node* q = p + node_count_;
        const auto add = [&](const Node& at, float weight) {
            sum.loss += weights_[k] * weight * at.loss;
            sum.cosine += weights_[k] * weight * at.cosine;
        };
        add(p[0], (1.0f - s) * (1.0f - t));
        add(p[1], (1.0f - s) * t);
        add(q[0], s * (1.0f - t));
        add(q[1], s * t);
    }
    return {sum.loss, (1.0f - sum.loss) * schlick_weight(sum.cosine * (mu + along))};
}

}  // namespace velatura::shading
