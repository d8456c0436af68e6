// SPDX-License-Identifier: Apache-2.0
// Pearson's test of the samples of every kind of light against their densities, over a grid of
// receivers: near, far, grazing, inside, under affine maps (docs/engineering/hard_cases.md
// H24 … H27).
#include "../sampling/chi_square.h"
#include "emissive_fixtures.h"
#include "hard_case.h"
#include "lights/emitter.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace velatura::lights {
namespace {

using sampling::testing::chi_square;
using sampling::testing::ChiSquare;
using sampling::testing::TestRandom;
using scene::LightKind;

/// Two-sided 1 % for all tests together (Šidák), as a one-sided normal deviate of one test.
double critical_deviate(int tests) {
    const double alpha = 1.0 - std::pow(0.99, 1.0 / tests);
    double low = 0, high = 10;
    for (int i = 0; i < 60; ++i) {
        const double z = (low + high) / 2;
        (0.5 * std::erfc(z / std::sqrt(2.0)) > alpha ? low : high) = z;
    }
    return low;
}

/// A light's surface, or the directions of a light at infinity, over the unit square: cells of it
/// hold whole pieces of the light, so that integrals over them converge fast.
struct Chart {
    std::function<Vec3d(const Vec2d&)> point;  ///< direction for lights at infinity
    std::function<Vec2d(const Vec3d&)> coordinates;
    bool is_infinite = false;
    bool is_closed = false;         ///< seen on its outside only, unless p is inside
    bool has_hard_outline = false;  ///< the density does not fall to 0 towards it

    Vec3d normal(const Vec2d& st) const {
        const double h = 1e-6;
        const Vec3d ds = point({st.x + h, st.y}) - point({st.x - h, st.y});
        const Vec3d dt = point({st.x, st.y + h}) - point({st.x, st.y - h});
        return ds.cross(dt) / (4.0 * h * h);
    }
};

double turn_of(double y, double x) {
    const double t = std::atan2(y, x) / (2.0 * pi_d);
    return t < 0.0 ? t + 1.0 : t;
}

/// In object space, by kind; outward normals.
Chart object_chart(LightKind kind) {
    const auto turned = [](double r, double t) {
        return Vec2d(r * std::cos(2.0 * pi_d * t), r * std::sin(2.0 * pi_d * t));
    };
    Chart chart;
    if (kind == LightKind::Rect) {
        chart.point = [](const Vec2d& st) { return Vec3d(st.x - 0.5, st.y - 0.5, 0.0); };
        chart.coordinates = [](const Vec3d& q) { return Vec2d(q.x + 0.5, q.y + 0.5); };
    } else if (kind == LightKind::Disk) {
        chart.point = [=](const Vec2d& st) {
            const Vec2d q = turned(0.5 * std::sqrt(std::max(st.x, 0.0)), st.y);
            return Vec3d(q.x, q.y, 0.0);
        };
        chart.coordinates = [](const Vec3d& q) {
            return Vec2d(4.0 * (q.x * q.x + q.y * q.y), turn_of(q.y, q.x));
        };
    } else if (kind == LightKind::Sphere) {
        chart.is_closed = true;
        chart.point = [=](const Vec2d& st) {
            const double z = 1.0 - 2.0 * st.x;
            const Vec2d q = turned(0.5 * std::sqrt(std::max(0.0, 1.0 - z * z)), st.y);
            return Vec3d(q.x, q.y, 0.5 * z);
        };
        chart.coordinates = [](const Vec3d& q) { return Vec2d(0.5 - q.z, turn_of(q.y, q.x)); };
    } else {
        chart.is_closed = chart.has_hard_outline = true;
        chart.point = [=](const Vec2d& st) {
            const Vec2d q = turned(0.5, st.y);
            return Vec3d(0.5 - st.x, q.x, q.y);
        };
        chart.coordinates = [](const Vec3d& q) { return Vec2d(0.5 - q.x, turn_of(q.z, q.y)); };
    }
    return chart;
}

Chart light_chart(const scene::Light& light) {
    const Chart object = object_chart(light.kind);
    const Mat4d m = light.render_from_light, inverse = m.inverse();
    Chart chart = object;
    chart.point = [=](const Vec2d& st) { return transform_point(object.point(st), m); };
    chart.coordinates = [=](const Vec3d& q) {
        return object.coordinates(transform_point(q, inverse));
    };
    return chart;
}

Chart triangle_chart(const Vec3d& v0, const Vec3d& e1, const Vec3d& e2) {
    Chart chart;
    chart.point = [=](const Vec2d& st) {
        const double root = std::sqrt(st.x);
        return v0 + e1 * (root * st.y) + e2 * (root * (1.0 - st.y));
    };
    chart.coordinates = [=](const Vec3d& q) {
        const Vec3d n = e1.cross(e2), r = q - v0;
        const double b1 = r.cross(e2).dot(n) / n.dot(n), b2 = e1.cross(r).dot(n) / n.dot(n);
        const double root = b1 + b2;
        return Vec2d(root * root, root > 0.0 ? b1 / root : 0.0);
    };
    return chart;
}

/// Directions within a cone, by equal solid angles.
Chart cone_chart(const Vec3d& axis, double half_angle) {
    const double sine = std::sin(half_angle / 2.0), one_minus_cos = 2.0 * sine * sine;
    Chart chart;
    chart.is_infinite = true;
    chart.point = [=](const Vec2d& st) {
        const double below = st.x * one_minus_cos, r = std::sqrt(below * (2.0 - below));
        const double phi = 2.0 * pi_d * st.y;
        return from_axis_frame(axis, Vec3d(r * std::cos(phi), r * std::sin(phi), 1.0 - below));
    };
    chart.coordinates = [=](const Vec3d& w) {
        const Vec3d x = from_axis_frame(axis, {1, 0, 0}), y = from_axis_frame(axis, {0, 1, 0});
        const Vec3d apart = w - axis;
        return Vec2d(0.5 * apart.dot(apart) / one_minus_cos, turn_of(w.dot(y), w.dot(x)));
    };
    return chart;
}

struct Result {
    double z = 0, total = 0;
    int degrees = 0;
};

constexpr int cells = 8;  ///< along each side of the chart

int cell_of(const Vec2d& st) {
    const auto index = [](double x) { return std::clamp(int(x * cells), 0, cells - 1); };
    return index(st.x) * cells + index(st.y);
}

/// Every part of the surface turns its outside away from p.
bool is_inside(const Chart& chart, const Vec3& p) {
    for (int i = 0; i < 256; ++i) {
        const Vec2d st((i / 16 + 0.5) / 16, (i % 16 + 0.5) / 16);
        if (chart.normal(st).dot(chart.point(st) - Vec3d(p)) <= 0.0) return false;
    }
    return true;
}

/// Integral over [a, b] by Gauss and Kronrod's rules of 7 and 15 points, halved where they differ
/// by more than the tolerance, as they do at outlines. Ref: Piessens et al. 1983, "QUADPACK", QK15.
template <typename F>
double integral(const F& f, double a, double b, double tolerance, int halvings = 40) {
    constexpr double at[] = {0.0,
                             0.207784955007898468,
                             0.405845151377397167,
                             0.586087235467691130,
                             0.741531185599394440,
                             0.864864423359769073,
                             0.949107912342758525,
                             0.991455371120812640};
    constexpr double kronrod[] = {0.209482141084727828, 0.204432940075298892, 0.190350578064785410,
                                  0.169004726639267903, 0.140653259715525919, 0.104790010322250184,
                                  0.063092092629978553, 0.022935322010529225};
    constexpr double gauss[] = {0.417959183673469388, 0.0, 0.381830050505118945, 0.0,
                                0.279705391489276668, 0.0, 0.129484966168869693, 0.0};
    const double middle = (a + b) / 2, half = (b - a) / 2;
    double fine = 0, coarse = 0;
    for (int i = 0; i < 8; ++i) {
        const double both =
            i == 0 ? f(middle) : f(middle - half * at[i]) + f(middle + half * at[i]);
        fine += kronrod[i] * both;
        coarse += gauss[i] * both;
    }
    // Densities in floats are not smooth beyond their rounding
    const double error = std::abs(fine - coarse), rounding = 1e-6 * std::abs(fine);
    if (halvings == 0 || error * half <= tolerance || error <= rounding) return fine * half;
    return integral(f, a, middle, tolerance, halvings - 1) +
           integral(f, middle, b, tolerance, halvings - 1);
}

/// Integral of the density over each cell, from p; their sum to about `tolerance`.
std::vector<double> masses(
    const LightSet& lights, LightId id, const Chart& chart, const Vec3& p, double tolerance) {
    const bool shows_outside_only = chart.is_closed && !is_inside(chart, p);
    const auto density = [&](const Vec2d& st) {
        const Vec3d q = chart.point(st), n = chart.normal(st);
        const Vec3d v = chart.is_infinite ? q : q - Vec3d(p);
        const double r = std::sqrt(v.dot(v));
        const double facing = -n.dot(v) / r;
        if (shows_outside_only && facing <= 0.0) return 0.0;
        const double solid_angle = std::abs(facing) / (chart.is_infinite ? 1.0 : r * r);
        return double(lights.pdf(id, p, to_float(v / r))) * solid_angle;
    };
    const double side = 1.0 / cells;
    std::vector<double> result;
    for (int i = 0; i < cells; ++i) {
        for (int j = 0; j < cells; ++j) {
            const auto row = [&](double s) {
                return integral(
                    [&](double t) {
                        return density({s, t});
                    },
                    j * side, (j + 1) * side, tolerance);
            };
            result.push_back(integral(row, i * side, (i + 1) * side, tolerance * side));
        }
    }
    return result;
}

/// Share of the samples of a round body of about one unit whose directions pass it by in floats, at
/// max: half of those within that rounding of its outline, which is as wide as the root of it on
/// the body.
double passed_by(const Chart& chart, const Vec3& p) {
    if (!chart.has_hard_outline) return 0.0;
    const Vec3d v = chart.point({0.5, 0.5}) - Vec3d(p);
    return 0.5 * std::sqrt(0x1p-23 * (std::sqrt(v.dot(v)) + 1.0));
}

/// Samples a light from p and compares with its density; one more cell holds what found nothing.
Result compare(const LightSet& lights, LightId id, const Chart& chart, const Vec3& p, int count) {
    const double outline = passed_by(chart, p);
    const double tolerance = std::max({1e-6, 1.0 / count, outline / 100});
    std::vector<double> expected = masses(lights, id, chart, p, tolerance);
    Result result;
    for (double& e : expected) {
        result.total += e;
        e *= count;
    }
    expected.push_back(std::max(0.0, 1.0 - result.total) * count);
    std::vector<double> found(expected.size(), 0.0);
    TestRandom random(id.index * 1000 + id.part * 100 + 7);
    for (int i = 0; i < count; ++i) {
        const Vec2 u(random.uniform(), random.uniform());
        const auto s = lights.sample(id, p, u);
        size_t cell = found.size() - 1;
        if (s) {
            const Vec3d wi(s->wi);
            const Vec3d q = chart.is_infinite ? normalize(wi) : Vec3d(p) + wi * double(s->distance);
            cell = size_t(cell_of(chart.coordinates(q)));
        }
        found[cell] += 1.0;
    }
    // Nothing expected but rounding and nothing found says nothing
    if (found.back() == 0.0 && expected.back() < 5.0 + count * (tolerance + outline)) {
        expected.pop_back();
        found.pop_back();
    }
    const ChiSquare chi = chi_square(found, expected);
    result.z = chi.z;
    result.degrees = chi.degrees;
    return result;
}

Mat4d affine() {
    return matrix_of({1.3, 0.2, 0}, {-0.3, 0.8, 0.1}, {0.1, 0.4, 1.1}, {0.2, -0.1, 1.4});
}

/// Every finite kind, plain and under an affine map, and emissive triangles likewise.
void fill(EmissiveStage& stage) {
    for (const LightKind kind :
         {LightKind::Rect, LightKind::Disk, LightKind::Sphere, LightKind::Cylinder}) {
        stage.scene.lights.push_back(light_of(kind, translation(0.1, 0.2, 1.2)));
        stage.scene.lights.push_back(light_of(kind, affine()));
    }
    for (const float angle : {0.53f, 30.0f, 180.0f}) {
        stage.scene.lights.push_back(light_of(LightKind::Distant, affine()));
        stage.scene.lights.back().angle_deg = angle;
    }
    stage.scene.lights.push_back(light_of(LightKind::Dome));
    const auto glow = stage.add_material(Rgb(1.0f));
    stage.scene.shapes.push_back(EmissiveStage::triangles({{-0.5f, -0.4f, 1},
                                                           {0.7f, -0.3f, 1.2f},
                                                           {0.1f, 0.9f, 1.5f},
                                                           {3, 0, 1},
                                                           {3, 0.02f, 1},
                                                           {-3, 0, 1.1f}},
                                                          glow));
    stage.scene.prototypes.push_back(
        {"/Proto", {EmissiveStage::triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, glow)}});
    stage.add_instance(0, Mat4(affine()));
}

/// Charts of all lights of fill(), in the order of EmissiveStage::all().
std::vector<Chart> charts_of(const EmissiveStage& stage) {
    std::vector<Chart> charts;
    for (const scene::Light& light : stage.scene.lights) {
        const Mat4d& m = light.render_from_light;
        if (light.kind == LightKind::Dome)
            charts.push_back(cone_chart({0, 0, 1}, pi_d));
        else if (light.kind == LightKind::Distant)
            charts.push_back(cone_chart(normalize(Vec3d{m[2][0], m[2][1], m[2][2]}),
                                        double(light.angle_deg) / 2 * pi_d / 180));
        else
            charts.push_back(light_chart(light));
    }
    const auto& points = std::get<scene::Mesh>(stage.scene.shapes[0].geometry).points;
    for (size_t i = 0; i + 2 < points.size(); i += 3)
        charts.push_back(triangle_chart(Vec3d(points[i]), Vec3d(points[i + 1]) - Vec3d(points[i]),
                                        Vec3d(points[i + 2]) - Vec3d(points[i])));
    const Mat4d m(stage.scene.instances[0].render_from_prototype);
    charts.push_back(triangle_chart(transform_point(Vec3d(0.0), m),
                                    transform_direction(Vec3d(1, 0, 0), m),
                                    transform_direction(Vec3d(0, 1, 0), m)));
    return charts;
}

TEST(H24Densities, SamplesFollowThemForEveryLightFromEverywhere) {
    EmissiveStage stage;
    fill(stage);
    const LightSet& lights = stage.prepare();
    const std::vector<LightId> all = stage.all();
    const std::vector<Chart> charts = charts_of(stage);
    ASSERT_EQ(all.size(), charts.size());
    const Vec3 receivers[] = {
        {0, 0, 0},      {0.3f, 0.2f, 0.9f},  {0.12f, 0.23f, 1.17f},  // below, near, close to
        {30, -20, -40}, {-4, 0.2f, 1.19f},   {0.2f, 0.1f, 1.3f},     // far, grazing, inside
        {2, -3, 4},     {0.15f, 0.6f, 1.0f}, {-60, 40, -20},
    };
    std::vector<std::pair<std::string, Result>> results;
    const int count = int(hardcase::sized(40000, 1000000, 10000000));
    for (size_t i = 0; i < all.size(); ++i) {
        for (const Vec3& p : receivers) {
            int hits = 0;
            for (int k = 0; k < 64; ++k)
                hits +=
                    lights.sample(all[i], p, {(float(k % 8) + 0.5f) / 8, (float(k / 8) + 0.5f) / 8})
                        .has_value();
            if (hits == 0) continue;
            results.push_back({std::to_string(i) + " from " + std::to_string(p.x) + " " +
                                   std::to_string(p.y) + " " + std::to_string(p.z),
                               compare(lights, all[i], charts[i], p, count)});
        }
    }
    const double critical = critical_deviate(int(results.size()));
    double worst = 0, largest = 0;
    for (const auto& [what, r] : results) {
        worst = hardcase::larger(worst, r.z);
        largest = std::max(largest, r.total);
        EXPECT_LE(r.z, critical) << "light " << what << ", mass " << r.total;
        EXPECT_GE(r.degrees, 1) << "light " << what;
    }
    hardcase::expect_within(
        {fmt::format("worst chi-square deviate of {} lights and receivers", results.size()), worst,
         critical, 0, "the density, integrated over cells",
         fmt::format("a cell wrong by {:.0f} %",
                     100 * sampling::testing::smallest_detectable(count, 64))});
    EXPECT_LE(largest, 1.0 + 2e-3);
    EXPECT_GT(results.size(), 100u);
}

}  // namespace
}  // namespace velatura::lights
