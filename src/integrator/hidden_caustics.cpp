// SPDX-License-Identifier: Apache-2.0
#include "integrator/hidden_caustics.h"

#include "base/hash.h"
#include "base/tasks.h"
#include "integrator/light_tracer.h"
#include "integrator/trial_layers.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace velatura::integrator {

namespace {

/// Keeps the random numbers of the trial apart from those of the render.
constexpr uint64_t trial_seed_salt = 0x68696464656e2163ull;

constexpr uint64_t photon_count = uint64_t(1) << 16, photons_per_chunk = 1024;
constexpr int max_to_a_side = 64, pixels_apart = 4;
constexpr uint64_t trial_samples = 4;
/// Of a path; later ones see little.
constexpr size_t max_vertices = 4;
/// That count for a vertex: of more, every n-th.
constexpr size_t max_photons = 256;
/// Photons count for a vertex within this share of the distance that half of the vertices have from
/// the camera.
constexpr double gather_share = 0.02;
/// Normals turn by less than 60 degrees between a vertex and a photon that counts for it.
constexpr float min_normal_cosine = 0.5f;
/// Of lights nearly without extent, which paths find in no image at all.
constexpr double max_carried = 1e6;

/// Of a squared error where the image is so bright.
double error_weight(double luminance) {
    return 1.0 / (luminance * luminance + 0.01);
}

/// Where a path scatters that may meet a caustic.
struct EyeVertex {
    geometry::SurfacePoint point;
    Vec3 wo;
    Rgb beta;
    uint32_t pixel = 0;
};

/// Keeps the vertices of paths.
class Eye : public PathObserver {
  public:
    void begin(uint32_t pixel) {
        pixel_ = pixel;
        end_ = vertices.size() + max_vertices;
    }

    void on_hidden_receiver(const geometry::SurfacePoint& point,
                            const Vec3& wo,
                            const Rgb& beta) override {
        if (vertices.size() < end_) vertices.push_back({point, wo, beta, pixel_});
    }

    void on_hit(int, const geometry::SurfacePoint&, float, const Rgb&) override {}

    void on_deposit(int, scene::GroupId, const Rgb&, const char*) override {}

    void on_end(int, const char*) override {}

    std::vector<EyeVertex> vertices;

  private:
    uint32_t pixel_ = 0;
    size_t end_ = 0;
};

/// Photons by place.
class PhotonGrid {
  public:
    PhotonGrid(const std::vector<CausticArrival>& photons, double radius)
        : photons_(photons), radius_(radius) {
        for (uint32_t i = 0; i < photons.size(); ++i)
            cells_[key(photons[i].p, 0, 0, 0)].push_back(i);
    }

    /// Calls visit(photon, how many it stands for).
    template <class Visitor>
    void for_each_near(const Vec3& p, const Visitor& visit) const {
        std::array<const std::vector<uint32_t>*, 27> cells{};
        size_t count = 0, photons = 0;
        for (int dx = -1; dx <= 1; ++dx)
            for (int dy = -1; dy <= 1; ++dy)
                for (int dz = -1; dz <= 1; ++dz)
                    if (const auto at = cells_.find(key(p, dx, dy, dz)); at != cells_.end()) {
                        photons += at->second.size();
                        cells[count++] = &at->second;
                    }
        const size_t stride = photons / max_photons + 1;
        size_t number = 0;
        for (size_t cell = 0; cell < count; ++cell)
            for (const uint32_t i : *cells[cell])
                if (number++ % stride == 0 &&
                    double((photons_[i].p - p).length2()) < radius_ * radius_)
                    visit(photons_[i], double(stride));
    }

  private:
    uint64_t key(const Vec3& p, int dx, int dy, int dz) const {
        constexpr double farthest = 0x1p62;
        const auto index = [&](float x, int d) {
            return uint64_t(
                int64_t(std::clamp(std::floor(double(x) / radius_), -farthest, farthest)) + d);
        };
        return hash_combine(hash_combine(index(p.x, dx), index(p.y, dy)), index(p.z, dz));
    }

    const std::vector<CausticArrival>& photons_;
    double radius_;
    std::unordered_map<uint64_t, std::vector<uint32_t>> cells_;
};

class Trial {
  public:
    Trial(const World& world, const PathTracerOptions& options, const std::atomic<bool>* stop)
        : world_(world), options_(options), stop_(stop), layers_(trial_layers(world.scene)) {
        options_.seed = hash_combine(options.seed, trial_seed_salt);
        options_.branches = nullptr;
        const scene::RenderSettings& s = world.scene.settings;
        columns_ = std::clamp(s.width / pixels_apart, 1, max_to_a_side);
        rows_ = std::clamp(s.height / pixels_apart, 1, max_to_a_side);
    }

    HiddenCaustics run() {
        trace_paths();
        if (!eye_.empty()) trace_photons();
        if (!photons_.empty() && !is_stopped()) out_.light = gather();
        return std::move(out_);
    }

  private:
    bool is_stopped() const { return stop_ && stop_->load(std::memory_order_relaxed); }

    void trace_paths() {
        struct Row {
            Eye eye;
            RayCounts rays;
        };

        means_.resize(size_t(columns_) * size_t(rows_));
        const PathTracer tracer(world_, layers_, options_);
        std::vector<Row> rows{size_t(rows_)};
        parallel_for(rows.size(), [&](size_t row) {
            film::SampleRadiance radiance(layers_);
            for (int column = 0; column < columns_ && !is_stopped(); ++column)
                trace_pixel(tracer, column, int(row), radiance, rows[row].eye, rows[row].rays);
        });
        for (const Row& row : rows) {
            out_.rays += row.rays;
            eye_.insert(eye_.end(), row.eye.vertices.begin(), row.eye.vertices.end());
        }
    }

    void trace_pixel(const PathTracer& tracer,
                     int column,
                     int row,
                     film::SampleRadiance& radiance,
                     Eye& eye,
                     RayCounts& rays) {
        const scene::RenderSettings& s = world_.scene.settings;
        const int x = int((2 * int64_t(column) + 1) * s.width / (2 * columns_)),
                  y = int((2 * int64_t(row) + 1) * s.height / (2 * rows_));
        const auto pixel = uint32_t(row * columns_ + column);
        for (uint64_t i = 0; i < trial_samples; ++i) {
            radiance.clear();
            eye.begin(pixel);
            tracer.trace(x, y, i, radiance, rays, &eye);
            if (!radiance.is_bad())
                means_[pixel] += double(luminance(radiance.radiance())) / double(trial_samples);
        }
    }

    void trace_photons() {
        struct Chunk {
            std::vector<CausticArrival> arrivals;
            RayCounts rays;
        };

        const LightTracer tracer(world_, layers_, options_);
        // Their order does not depend on the threads
        std::vector<Chunk> chunks(photon_count / photons_per_chunk);
        parallel_for(chunks.size(), [&](size_t c) {
            if (is_stopped()) return;
            tracer.record(c * photons_per_chunk, (c + 1) * photons_per_chunk, chunks[c].arrivals,
                          chunks[c].rays);
        });
        for (const Chunk& chunk : chunks) {
            photons_.insert(photons_.end(), chunk.arrivals.begin(), chunk.arrivals.end());
            out_.rays += chunk.rays;
        }
    }

    /// Distance from the camera, near the origin of render space, that half of the vertices have.
    double median_distance() const {
        std::vector<float> distances;
        distances.reserve(eye_.size());
        for (const EyeVertex& v : eye_) distances.push_back(v.point.p.length());
        const auto middle = distances.begin() + std::ptrdiff_t(distances.size() / 2);
        std::nth_element(distances.begin(), middle, distances.end());
        return double(*middle);
    }

    statistics::HiddenLight gather() const {
        const double radius = gather_share * median_distance();
        statistics::HiddenLight sum;
        if (!(radius > 0.0)) return sum;
        const PhotonGrid grid(photons_, radius);
        std::vector<statistics::HiddenLight> found(eye_.size());
        parallel_for(eye_.size(), [&](size_t i) { found[i] = gather_at(eye_[i], grid, radius); });
        const double paths = double(means_.size()) * double(trial_samples);
        for (size_t i = 0; i < eye_.size(); ++i) {
            const double weight = error_weight(means_[eye_[i].pixel]);
            sum.square += found[i].square * weight / paths;
            sum.fourth += found[i].fourth * weight * weight / paths;
        }
        return sum;
    }

    /// Moments of what BSDF sampling at a vertex brings of caustics.
    statistics::HiddenLight gather_at(const EyeVertex& v,
                                      const PhotonGrid& grid,
                                      double radius) const {
        statistics::HiddenLight out;
        const shading::Bsdf bsdf =
            world_.materials.make_bsdf(v.point, v.wo, world_.camera.footprint(v.point.p));
        const double per_area = 1.0 / (pi_d * radius * radius * double(photon_count));
        grid.for_each_near(v.point.p, [&](const CausticArrival& a, double photons) {
            if (!(a.n.dot(bsdf.ns()) > min_normal_cosine)) return;
            const shading::BsdfValue value = bsdf.evaluate(v.wo, a.wi);
            const Rgb f = value.f();
            if (is_black(f) || !(value.pdf > 0.0f)) return;
            const double brings = double(luminance(v.beta * f * a.flux)) * per_area * photons,
                         carries = double(luminance(v.beta * f * a.path_radiance) *
                                          bsdf.cosine(a.wi) / value.pdf);
            if (!std::isfinite(brings) || !(carries < max_carried)) return;
            out.square += brings * carries;
            out.fourth += brings * carries * carries * carries;
        });
        return out;
    }

    const World& world_;
    PathTracerOptions options_;
    const std::atomic<bool>* stop_;
    film::LayerSet layers_;
    int columns_ = 1, rows_ = 1;
    std::vector<double> means_;  ///< luminance of the trial's pixels
    std::vector<EyeVertex> eye_;
    std::vector<CausticArrival> photons_;
    HiddenCaustics out_;
};

}  // namespace

HiddenCaustics try_hidden_caustics(const World& world,
                                   const PathTracerOptions& options,
                                   const std::atomic<bool>* stop) {
    const auto start = std::chrono::steady_clock::now();
    HiddenCaustics out = Trial(world, options, stop).run();
    out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return out;
}

}  // namespace velatura::integrator
