// SPDX-License-Identifier: Apache-2.0
// What more triangles cost: rays per second, build time and memory of one displaced sphere from
// 10^4 to 3·10^7 triangles, beside Embree robust where that is installed. One thread, CPU time.
// Prints a table, and on demand writes it as CSV and the rates as a log-log plot (SVG).
#include "accel/bvh.h"
#include "accel/ray_stream.h"
#include "base/atomic_file.h"
#include "base/tasks.h"
#include "bench_scenes.h"
#include "cpu_clock.h"
#include "parse_options.h"
#include "ray_sets.h"
#ifdef VELATURA_HAVE_EMBREE
#include "embree_peer.h"
#endif

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <vector>

namespace velatura::bench {
namespace {

constexpr std::array<const char*, 3> kinds = {"primary", "bounce1", "shuffled"};

// What one tracer does with one number of triangles. Rates in Mrays/s, 0: not measured.
struct Row {
    size_t triangles = 0;
    std::array<double, 3> own = {}, peer = {};
    double own_build = 0, peer_build = 0;  // CPU seconds
    double own_bytes = 0, peer_bytes = 0;  // per triangle
};

// The best of some rounds: whatever disturbs one makes it slower.
double best_rate(size_t rays, int rounds, const std::function<size_t()>& trace) {
    double best = 0;
    size_t sink = trace();
    for (int i = 0; i < rounds; ++i) {
        const double start = thread_seconds();
        sink += trace();
        best = std::max(best, double(rays) * 1e-6 / (thread_seconds() - start));
    }
    return sink == size_t(-1) ? 0 : best;
}

double own_rate(const accel::Accelerator& bvh, const RaySet& set, int rounds) {
    accel::RayStream stream(bvh);
    std::vector<geometry::Hit> hits(4096);
    const std::span<const geometry::Ray> rays(set.rays);
    const auto once = [&] {
        size_t count = 0;
        for (size_t i = 0; i < rays.size(); i += hits.size()) {
            const auto some = rays.subspan(i, std::min(hits.size(), rays.size() - i));
            stream.intersect(some, hits);
            for (size_t k = 0; k < some.size(); ++k) count += hits[k].is_valid();
        }
        return count;
    };
    while (!stream.has_chosen() && rays.size() >= accel::RayStream::smallest_trial &&
           bvh.has_batches())
        once();
    return best_rate(rays.size(), rounds, once);
}

Row measure(size_t wanted, int size, int rounds) {
    const BenchScene scene = make_statue(int(std::lround(0.5 * std::sqrt(double(wanted)))));
    const accel::SoupScene soup = scene.soup();
    const ThreadLimit one(1);
    Row row;
    row.triangles = scene.triangle_count();
    const double start = cpu_seconds();
    const auto bvh = accel::build_bvh(soup);
    row.own_build = cpu_seconds() - start;
    row.own_bytes = double(bvh->stats().bytes) / double(row.triangles);
    const std::vector<RaySet> sets = make_ray_sets(scene, *bvh, size);
    const auto of_kind = [&](const char* kind) {
        return std::find_if(sets.begin(), sets.end(),
                            [&](const RaySet& set) { return set.kind == kind; });
    };
    for (size_t k = 0; k < kinds.size(); ++k) {
        const auto set = of_kind(kinds[k]);
        if (set != sets.end()) row.own[k] = own_rate(*bvh, *set, rounds);
    }
#ifdef VELATURA_HAVE_EMBREE
    const EmbreePeer peer(soup, EmbreeMode::RobustMedium);
    row.peer_build = peer.build_seconds();
    row.peer_bytes = double(peer.tree_bytes()) / double(row.triangles);
    for (size_t k = 0; k < kinds.size(); ++k) {
        const auto set = of_kind(kinds[k]);
        if (set == sets.end()) continue;
        row.peer[k] = best_rate(set->rays.size(), rounds, [&] {
            size_t count = 0;
            for (const geometry::Ray& ray : set->rays)
                count += peer.closest(ray) < std::numeric_limits<float>::infinity();
            return count;
        });
    }
#endif
    return row;
}

std::string csv_of(const std::vector<Row>& rows) {
    std::string csv = "triangles";
    for (const char* who : {"own", "embree"}) {
        for (const char* kind : kinds) csv += fmt::format(",{}_{}_mrays", who, kind);
        csv += fmt::format(",{0}_build_s,{0}_bytes", who);
    }
    csv += "\n";
    for (const Row& r : rows) {
        csv += fmt::format(
            "{},{:.3f},{:.3f},{:.3f},{:.3f},{:.1f},{:.3f},{:.3f},{:.3f},{:.3f},{:.1f}\n",
            r.triangles, r.own[0], r.own[1], r.own[2], r.own_build, r.own_bytes, r.peer[0],
            r.peer[1], r.peer[2], r.peer_build, r.peer_bytes);
    }
    return csv;
}

// Rates against triangles, both axes logarithmic: 10^4 … 10^8 and 0.1 … 100 Mrays/s.
class Plot {
  public:
    void add(const std::vector<Row>& rows,
             const std::array<double, 3> Row::*rates,
             size_t kind,
             const std::string& color,
             const std::string& name) {
        std::string points;
        for (const Row& r : rows) {
            if ((r.*rates)[kind] > 0)
                points +=
                    fmt::format("{:.1f},{:.1f} ", x(double(r.triangles)), y((r.*rates)[kind]));
        }
        if (points.empty()) return;
        const char* const dash = kind == 0   ? ""
                                 : kind == 1 ? " stroke-dasharray='7 3'"
                                             : " stroke-dasharray='2 3'";
        const std::string stroke =
            fmt::format("fill='none' stroke='{}' stroke-width='2'{}", color, dash);
        body_ += fmt::format("<polyline points='{}' {}/>\n", points, stroke);
        const int at = 40 + 16 * names_++;
        body_ += fmt::format("<polyline points='{0},{2} {1},{2}' {3}/>\n", right - 190, right - 158,
                             at - 4, stroke);
        body_ +=
            fmt::format("<text x='{}' y='{}' fill='{}'>{}</text>\n", right - 150, at, color, name);
    }

    std::string svg() const {
        std::string grid;
        for (int e = 4; e <= 8; ++e)
            grid += line(x(std::pow(10.0, e)), top, x(std::pow(10.0, e)), bottom) +
                    fmt::format("<text x='{:.0f}' y='{}' text-anchor='middle'>1e{}</text>\n",
                                x(std::pow(10.0, e)), bottom + 18, e);
        for (int e = -1; e <= 2; ++e)
            grid += line(left, y(std::pow(10.0, e)), right, y(std::pow(10.0, e))) +
                    fmt::format("<text x='{}' y='{:.0f}' text-anchor='end'>{}</text>\n", left - 6,
                                y(std::pow(10.0, e)) + 4, std::pow(10.0, e));
        return fmt::format(
            "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 640 420' "
            "font-family='sans-serif' "
            "font-size='12'>\n<rect width='640' height='420' fill='white'/>\n{}{}"
            "<text x='350' y='408' text-anchor='middle'>triangles</text>\n"
            "<text x='16' y='200' transform='rotate(-90 16 200)' text-anchor='middle'>Mrays/s, one "
            "core</text>\n</svg>\n",
            grid, body_);
    }

  private:
    static constexpr int left = 60, right = 620, top = 20, bottom = 370;

    static std::string line(double x1, double y1, double x2, double y2) {
        return fmt::format(
            "<line x1='{:.1f}' y1='{:.1f}' x2='{:.1f}' y2='{:.1f}' stroke='#ddd'/>\n", x1, y1, x2,
            y2);
    }

    static double x(double triangles) {
        return left + (std::log10(triangles) - 4) / 4 * (right - left);
    }

    static double y(double rate) { return bottom - (std::log10(rate) + 1) / 3 * (bottom - top); }

    std::string body_;
    int names_ = 0;
};

int run(size_t max, int size, int rounds, const std::string& output) {
    fmt::print(
        "  {:>10}  {:>23}  {:>23}  {:>13}  {:>13}\n  {:>10}  {:>7} {:>7} {:>7}  {:>7} {:>7} "
        "{:>7}  {:>6} {:>6}  {:>6} {:>6}\n",
        "", "own, Mrays/s", "Embree robust", "build, CPU s", "bytes/tri", "triangles", "prim.",
        "bounce", "shuff.", "prim.", "bounce", "shuff.", "own", "Embree", "own", "Embree");
    std::vector<Row> rows;
    for (const size_t triangles :
         {size_t(10000), size_t(30000), size_t(100000), size_t(300000), size_t(1000000),
          size_t(3000000), size_t(10000000), size_t(30000000)}) {
        if (triangles > max) break;
        rows.push_back(measure(triangles, size, rounds));
        const Row& r = rows.back();
        fmt::print(
            "  {:10}  {:7.2f} {:7.2f} {:7.2f}  {:7.2f} {:7.2f} {:7.2f}  {:6.2f} {:6.2f}  "
            "{:6.1f} {:6.1f}\n",
            r.triangles, r.own[0], r.own[1], r.own[2], r.peer[0], r.peer[1], r.peer[2], r.own_build,
            r.peer_build, r.own_bytes, r.peer_bytes);
        std::fflush(stdout);
    }
    if (output.empty()) return 0;
    Plot plot;
    for (size_t k = 0; k < kinds.size(); ++k) {
        plot.add(rows, &Row::own, k, "#b03020", fmt::format("own, {}", kinds[k]));
        plot.add(rows, &Row::peer, k, "#3050a0", fmt::format("Embree robust, {}", kinds[k]));
    }
    const auto csv = write_file_atomically(output + ".csv", csv_of(rows));
    const auto svg = write_file_atomically(output + ".svg", plot.svg());
    return csv && svg ? 0 : 1;
}

}  // namespace
}  // namespace velatura::bench

int main(int argc, char** argv) {
    velatura::CommandLine app(
        "Rays per second, build time and memory against the number of triangles");
    size_t max = 30000000;
    int size = 320, rounds = 3;
    std::string output;
    app.add_option("--most", max, "triangles of the largest mesh");
    app.add_option("--size", size, "edge of the picture; its square is the rays per set")
        .range(16, 4096);
    app.add_option("--rounds", rounds, "how often each set is timed; the best counts").range(1, 99);
    app.add_option("-o,--output", output, "write <output>.csv and <output>.svg");
    if (const auto code = velatura::bench::parse_options(app, argc, argv)) return *code;
    return velatura::bench::run(max, size / 16 * 16, rounds, output);
}
