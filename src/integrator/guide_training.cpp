// SPDX-License-Identifier: Apache-2.0
#include "integrator/guide_training.h"

#include "base/hash.h"
#include "base/tasks.h"
#include "integrator/trial_layers.h"
#include "sampling/owen.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <vector>

namespace velatura::integrator {

namespace {

/// Keeps the random numbers of the training apart from those of the render: a field that knew the
/// samples it guides would be biased.
constexpr uint64_t training_seed_salt = 0x67756964696e6721ull;

constexpr size_t pixels_per_path = 4;  // in the first round
constexpr size_t min_paths = size_t(1) << 12, max_paths = size_t(1) << 16;
constexpr int rounds = 3;
constexpr size_t paths_per_chunk = 256;
/// Vertices of a path that are recorded; what arrives at later ones still counts for these.
constexpr size_t recorded_vertices = 16;

/// Below this relative variance of a camera sample, 64 samples leave an error under 18 %, and
/// guiding could at best halve it at more than the usual cost.
constexpr double min_trial_variance = 2.0;
/// Time of a guided ray over that of an unguided one: looking up and sampling what was learned.
constexpr double guided_ray_cost = 1.5;
/// Where guiding is no gain, 10 of 16 or more come by chance in less than a quarter of all cases,
/// and then little is lost.
constexpr int min_wins = 10;
/// Side of the blocks of the image that share a mean, pixels.
constexpr uint32_t block_size = 16;

/// What one path of a round came to.
struct Trial {
    uint32_t block = 0;
    uint32_t rays = 0;
    float total = 0;     ///< luminance
    float indirect = 0;  ///< the part after two scatterings or more
};

struct Round {
    std::vector<guiding::TrainingSample> records;
    std::vector<Trial> trials;  // [path]
    RayCounts rays;

    void append(const Round& other) {
        records.insert(records.end(), other.records.begin(), other.records.end());
        trials.insert(trials.end(), other.trials.begin(), other.trials.end());
        rays += other.rays;
    }
};

/// Turns paths into records and trials.
class PathRecorder : public PathObserver {
  public:
    explicit PathRecorder(Round& out) : out_(out) {}

    void begin(uint32_t block) { trial_ = {block, 0, 0.0f, 0.0f}; }

    void end(uint32_t rays) {
        trial_.rays = rays;
        out_.trials.push_back(trial_);
    }

    void on_hit(int, const geometry::SurfacePoint&, float, const Rgb&) override {}

    void on_deposit(int bounce, scene::GroupId, const Rgb& radiance, const char*) override {
        const float L = luminance(radiance);
        trial_.total += L;
        if (bounce >= 2) trial_.indirect += L;
        for (Vertex& v : vertices_) {
            if (v.is_scattered) v.record.weight += L * v.inverse_beta;
        }
    }

    void on_vertex(const guiding::GuidingPoint& at, const Rgb& beta) override {
        is_recorded_ = vertices_.size() < recorded_vertices;
        if (is_recorded_)
            vertices_.push_back({{at, Vec3(0.0f), 0.0f}, 1.0f / luminance(beta), false});
    }

    void on_scatter(const Vec3& wi) override {
        if (!is_recorded_) return;
        vertices_.back().record.wi = wi;
        vertices_.back().is_scattered = true;
    }

    void on_end(int, const char*) override {
        for (const Vertex& v : vertices_) out_.records.push_back(v.record);
        vertices_.clear();
        is_recorded_ = false;
    }

  private:
    struct Vertex {
        guiding::TrainingSample record;
        float inverse_beta = 0;     ///< 1 / luminance
        bool is_scattered = false;  ///< else absorbed, or scattered by a delta lobe: nothing
                                    ///< arrived the learned way
    };

    Round& out_;
    Trial trial_;
    std::vector<Vertex> vertices_;
    bool is_recorded_ = false;  ///< the vertex that the path is at
};

class Trainer {
  public:
    Trainer(const World& world, const PathTracerOptions& options, const std::atomic<bool>* stop)
        : world_(world),
          options_(options),
          stop_(stop),
          width_(uint32_t(world.scene.settings.width)),
          height_(uint32_t(world.scene.settings.height)) {
        options_.seed = hash_combine(options.seed, training_seed_salt);
        layers_ = trial_layers(world.scene);
    }

    void run(Guiding guiding, GuideTraining& out) {
        const size_t count =
            std::clamp(size_t(width_) * height_ / pixels_per_path, min_paths, max_paths);
        Round all = trace(0, count, nullptr);
        const std::vector<Trial> unguided = all.trials;
        out.rays = all.rays;
        out.trial_variance = mean_variance(unguided);
        if (guiding == Guiding::Auto && !(out.trial_variance >= min_trial_variance)) return;

        std::vector<Trial> guided;  // of the last round
        size_t first = count;
        for (int k = 1; k < rounds && !is_stopped(); ++k) {
            out.field = guiding::GuidingField(all.records);
            Round round = trace(first, count << k, &out.field);
            first += count << k;
            all.append(round);
            guided = std::move(round.trials);
        }
        out.rays = all.rays;
        // Chunks that a stop left out are missing from the trials
        if (is_stopped()) return;
        out.field = guiding::GuidingField(all.records);
        out.wins = count_wins(unguided, guided);
        out.is_used = !out.field.is_empty() && (guiding == Guiding::On || out.wins >= min_wins);
    }

  private:
    using Groups = std::array<double, GuideTraining::group_count>;

    bool is_stopped() const { return stop_ && stop_->load(std::memory_order_relaxed); }

    /// Paths first … first + count, spread evenly over the image. Their order does not depend on
    /// the threads.
    Round trace(size_t first, size_t count, const guiding::GuidingField* field) const {
        PathTracerOptions options = options_;
        options.guide = field;
        const PathTracer tracer(world_, layers_, options);
        std::vector<Round> chunks((count + paths_per_chunk - 1) / paths_per_chunk);
        parallel_for(chunks.size(), [&](size_t c) {
            if (is_stopped()) return;
            film::SampleRadiance radiance(layers_);
            PathRecorder recorder(chunks[c]);
            const size_t end = std::min(count, (c + 1) * paths_per_chunk);
            for (size_t i = c * paths_per_chunk; i < end; ++i) {
                // The Sobol' sequence covers the image evenly after any number of paths
                const uint32_t index = uint32_t(first + i);
                const uint32_t x =
                    uint32_t((uint64_t(sampling::reverse_bits(index)) * width_) >> 32);
                const uint32_t y =
                    uint32_t((uint64_t(sampling::reverse_bits(sampling::sobol_1_reversed(index))) *
                              height_) >>
                             32);
                const uint64_t rays_before = chunks[c].rays.total();
                recorder.begin(y / block_size * blocks_across() + x / block_size);
                radiance.clear();
                tracer.trace(int(x), int(y), index, radiance, chunks[c].rays, &recorder);
                recorder.end(uint32_t(chunks[c].rays.total() - rays_before));
            }
        });
        Round out;
        for (const Round& chunk : chunks) out.append(chunk);
        return out;
    }

    uint32_t blocks_across() const { return (width_ + block_size - 1) / block_size; }

    /// Mean luminance and indirect luminance of every block.
    struct BlockMean {
        double total = 0, indirect = 0;
        size_t count = 0;
    };

    std::vector<BlockMean> block_means(const std::vector<Trial>& trials) const {
        std::vector<BlockMean> means(size_t(blocks_across()) *
                                     ((height_ + block_size - 1) / block_size));
        for (const Trial& t : trials) {
            BlockMean& m = means[t.block];
            if (!std::isfinite(t.total)) continue;
            m.total += double(t.total);
            m.indirect += double(t.indirect);
            ++m.count;
        }
        for (BlockMean& m : means) {
            if (m.count == 0) continue;
            m.total /= double(m.count);
            m.indirect /= double(m.count);
        }
        return means;
    }

    /// Relative squared deviation of the path's indirect light.
    static double deviation(const Trial& t, const BlockMean& m) {
        if (!std::isfinite(t.total)) return 0.0;
        const double d = double(t.indirect) - m.indirect;
        return d * d / (m.total * m.total + 0.01);
    }

    double mean_variance(const std::vector<Trial>& trials) const {
        const std::vector<BlockMean> means = block_means(trials);
        double sum = 0;
        for (const Trial& t : trials) sum += deviation(t, means[t.block]);
        return sum / double(trials.size());
    }

    /// Variance times rays, both summed by group: proportional to 1 / efficiency. A group is a run
    /// of paths, which covers the whole image. As many guided paths as unguided ones, for the
    /// variance of few paths is mostly seen too small.
    int count_wins(const std::vector<Trial>& unguided, const std::vector<Trial>& guided) const {
        std::vector<Trial> both = unguided;
        both.insert(both.end(), guided.begin(), guided.begin() + std::ptrdiff_t(unguided.size()));
        const std::vector<BlockMean> means = block_means(both);
        const auto inefficiency = [&](const Trial* trials) {
            Groups variance{}, rays{}, out{};
            for (size_t i = 0; i < unguided.size(); ++i) {
                const size_t g = i * out.size() / unguided.size();
                variance[g] += deviation(trials[i], means[trials[i].block]);
                rays[g] += double(trials[i].rays);
            }
            for (size_t g = 0; g < out.size(); ++g) out[g] = variance[g] * rays[g];
            return out;
        };
        const Groups without = inefficiency(both.data()),
                     with = inefficiency(both.data() + unguided.size());
        int wins = 0;
        for (size_t g = 0; g < with.size(); ++g)
            wins += guided_ray_cost * with[g] < without[g] ? 1 : 0;
        return wins;
    }

    const World& world_;
    PathTracerOptions options_;
    film::LayerSet layers_;
    const std::atomic<bool>* stop_;
    uint32_t width_, height_;
};

}  // namespace

std::optional<Guiding> guiding_mode(std::string_view name) {
    if (name == "off") return Guiding::Off;
    if (name == "auto") return Guiding::Auto;
    if (name == "on") return Guiding::On;
    return std::nullopt;
}

GuideTraining train_guide(const World& world,
                          const PathTracerOptions& options,
                          Guiding guiding,
                          const std::atomic<bool>* stop) {
    GuideTraining out;
    // Chains of mirrors have no direction to choose
    if (guiding == Guiding::Off || options.estimator.specular_chains_only) return out;
    const auto start = std::chrono::steady_clock::now();
    Trainer(world, options, stop).run(guiding, out);
    out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return out;
}

}  // namespace velatura::integrator
