// SPDX-License-Identifier: Apache-2.0
#include "selftest/number_checks.h"

#include "film/film.h"
#include "media/henyey_greenstein.h"
#include "sampling/mis.h"
#include "sampling/owen.h"
#include "sampling/sampler.h"
#include "selftest/random.h"
#include "shading/bsdf.h"
#include "shading/fresnel.h"
#include "shading/ggx.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace velatura::selftest {

namespace {

using Long = long double;

/// Of two, and of what is no number: that.
double larger(double a, double b) {
    return std::isnan(b) || b > a ? b : a;
}

/// Numbers of whose mean the standard error is known.
class Mean {
  public:
    void add(double x) {
        ++count_;
        sum_ += x;
        squares_ += x * x;
    }

    double mean() const { return sum_ / double(count_); }

    /// Deviation that a test at 4 standard errors sees with 90 % power.
    double detectable() const {
        return 5.2816 * std::sqrt(std::max(0.0, squares_ / double(count_) - mean() * mean()) /
                                  double(count_ - 1));
    }

  private:
    uint64_t count_ = 0;
    double sum_ = 0, squares_ = 0;
};

}  // namespace

Finding frames(uint64_t amount) {
    Random random(11);
    double worst = 0;
    const auto look_at = [&](const Vec3& n) {
        const Frame f = Frame::from_z(n);
        const Vec3d x(f.x), y(f.y), z(f.z);
        for (const double error :
             {x.dot(x) - 1, y.dot(y) - 1, x.dot(y), x.dot(z), y.dot(z), x.cross(y).dot(z) - 1})
            worst = larger(worst, std::abs(error));
    };
    // About the pole at which such formulas divide by nothing
    for (const float s : {0.0f, 1e-3f, 1e-8f, 1e-20f, std::numeric_limits<float>::denorm_min()})
        look_at(normalize(Vec3(s, -s, -1.0f)));
    const uint64_t count = 200000 * amount;
    for (uint64_t i = 0; i < count; ++i) look_at(random.direction());
    return {fmt::format("axes of {} frames: products, from 0 and 1", count), worst, 1e-6};
}

Finding ggx_distribution(uint64_t amount) {
    Random random(12);
    double worst = 0;
    const uint64_t count = 5000 * amount;
    for (const float alpha : {1.0f, 0.1f, 0.01f, 1e-3f, 1e-4f}) {
        for (uint64_t i = 0; i < count; ++i) {
            // Around the peak and in the tail
            const float slope = alpha * std::exp(random.between(-5.0f, 3.0f)),
                        phi = random.between(0.0f, 2.0f * pi);
            const float z = 1.0f / std::sqrt(1.0f + slope * slope);
            const Vec3 m(slope * z * std::cos(phi), slope * z * std::sin(phi), z);
            const Long a = alpha, x = m.x / a, y = m.y / a, w = m.z, s = x * x + y * y + w * w;
            const Long exact = 1 / (3.14159265358979323846L * a * a * s * s);
            worst = larger(worst, double(std::abs(shading::ggx_d(m, alpha) / exact - 1)));
        }
    }
    return {"distribution of facets, widths 1 to 1e-4, relative", worst, 1e-5};
}

Finding metal_energy(uint64_t amount) {
    // Mean weight of its own samples, by 16 sets of points
    const uint64_t samples = 16384 * amount;
    double worst = 0, detectable = 0;
    for (const float alpha : {0.01f, 0.1f, 0.5f, 1.0f}) {
        for (const float mu : {0.1f, 0.5f, 1.0f}) {
            shading::SurfaceParameters metal;
            metal.diffuse = Rgb(0.0f);
            metal.f0 = metal.f90 = Rgb(1.0f);
            metal.alpha = alpha;
            const Vec3 up(0.0f, 0.0f, 1.0f), wo(std::sqrt(1.0f - mu * mu), 0.0f, mu);
            const shading::Bsdf bsdf(metal, up, up, wo);
            Mean of_sets;
            for (int set = 0; set < 16; ++set) {
                double sum = 0;
                for (uint64_t i = 0; i < samples; ++i) {
                    const sampling::PixelSampler sampler(5, set, 0, i);
                    const auto s =
                        bsdf.sample_f(wo, sampler.get_1d(0, sampling::Purpose::BsdfLobe),
                                      sampler.get_2d(0, sampling::Purpose::BsdfDirection));
                    if (s) sum += double(s->f.x * bsdf.cosine(s->wi) / s->pdf);
                }
                of_sets.add(sum / double(samples));
            }
            worst = larger(worst, std::abs(of_sets.mean() - 1));
            detectable = std::max(detectable, of_sets.detectable());
        }
    }
    return {"light that white metals of widths 0.01 to 1 return, less 1", worst, 4e-3, detectable};
}

Finding fresnel(uint64_t amount) {
    Random random(14);
    double worst = 0;
    const uint64_t count = 20000 * amount;
    for (uint64_t i = 0; i < count; ++i) {
        // Also next to 1, from both sides, where little is left after subtractions
        const float eta = i % 2 == 0 ? std::exp2(random.between(-1.5f, 1.5f))
                                     : 1.0f + (i % 4 == 1 ? 1.0f : -1.0f) *
                                                  std::exp2(random.between(-23.0f, -1.0f));
        const float c = i % 3 == 0 ? random.unit() * random.unit() * 0.01f : random.unit();
        const Long cosine = c, n = eta, sine2 = (1 - cosine * cosine) / (n * n);
        Long exact = 1;
        if (sine2 < 1) {
            const Long t = std::sqrt(1 - sine2), p = (n * cosine - t) / (n * cosine + t),
                       s = (cosine - n * t) / (cosine + n * t);
            exact = (p * p + s * s) / 2;
        }
        // Just at total reflection a rounding of the angle decides
        if (std::abs(sine2 - 1) < 1e-5L) continue;
        worst = larger(worst, double(std::abs(Long(shading::fresnel_dielectric(c, eta)) - exact)));
    }
    return {fmt::format("reflectance of {} interfaces, indices around 1 included", count), worst,
            1e-5};
}

Finding scattering(uint64_t amount) {
    double worst = 0, detectable = 0;
    for (const float g : {0.0f, 0.5f, -0.9f, 0.999f}) {
        const media::HenyeyGreenstein phase(g);
        const Vec3 d(0.6f, -0.48f, 0.64f);
        Random random(15);
        Mean mean;
        for (uint64_t i = 0; i < 100000 * amount; ++i) {
            const float u = random.unit();
            mean.add(Vec3d(d).dot(Vec3d(phase.sample(d, Vec2(u, random.unit())))));
        }
        worst = larger(worst, std::abs(mean.mean() - double(g)));
        detectable = std::max(detectable, mean.detectable());
    }
    return {"mean cosine of smoke, minus its parameter", worst, 0.011, detectable};
}

Finding mis_weights(uint64_t) {
    const float largest = std::numeric_limits<float>::max(),
                infinite = std::numeric_limits<float>::infinity();
    const float densities[] = {
        0.0f,    std::numeric_limits<float>::denorm_min(), 1e-38f, 1.0f, 1e19f, 1e30f, largest,
        infinite};
    double worst = 0;
    for (const float a : densities) {
        for (const float b : densities) {
            for (const auto heuristic : {sampling::balance_heuristic, sampling::power_heuristic})
                worst =
                    larger(worst, std::abs(double(heuristic(a, b)) + double(heuristic(b, a)) - 1));
        }
    }
    return {"sum of both weights, densities 0 to infinity, less 1", worst, 1e-6};
}

Finding sums(uint64_t amount) {
    film::LayerSet set;
    set.groups = {{"key", {"/Key"}, false}};
    set.data_layers = false;
    film::Film film({0, 0, 1, 1}, set);
    film::SampleRadiance sample(set);
    film::PixelAccumulator pixel(set);
    Random random(16);
    const uint64_t count = 300000 * amount;
    // Multiples of 2^-23 and one flash: long double adds them without rounding
    Long exact = 0;
    film.begin_pixel(pixel, 0, 0, 0);
    for (uint64_t i = 0; i < count; ++i) {
        const float value = i == count / 3 ? 0x1p20f : 2.0f * random.unit();
        exact += Long(value);
        sample.clear();
        sample.add(1, 0, Rgb(value));
        pixel.add(sample);
    }
    film.end_pixel(pixel);
    const Long sum = film.sums().total(0, 0, accumulate::AccumulatorTable::beauty).x;
    return {fmt::format("sum of {} samples, one of them a flash, relative", count),
            double(std::abs(sum / exact - 1)), 1e-12};
}

Finding random_numbers(uint64_t amount) {
    uint64_t bad = sampling::unit_float(0xffffffffu) != 0x1.fffffep-1f;
    const uint64_t pixels = 32 * amount;
    constexpr uint64_t count = 256;
    for (uint64_t pixel = 0; pixel < pixels; ++pixel) {
        // Each of the 9 ways to cut the square into 256 cells of one area
        for (int k = 0; k <= 8; ++k) {
            std::vector<int> found(count);
            for (uint64_t i = 0; i < count; ++i) {
                const Vec2 u = sampling::PixelSampler(7, int(pixel), 3, 256 * pixel + i)
                                   .get_2d(2, sampling::Purpose::LightSurface);
                const auto column = uint64_t(u.x * float(1u << k)),
                           row = uint64_t(u.y * float(count >> k));
                if (!(u.x < 1.0f) || !(u.y < 1.0f))
                    ++bad;
                else
                    ++found[size_t(column * (count >> k) + row)];
            }
            bad +=
                uint64_t(std::count_if(found.begin(), found.end(), [](int n) { return n != 1; }));
        }
    }
    return {fmt::format("cells of the nets of {} pixels that do not hold one point", pixels),
            double(bad), 0};
}

}  // namespace velatura::selftest
