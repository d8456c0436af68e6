// SPDX-License-Identifier: Apache-2.0
// What each effect of a scene costs: renders by the program beside this one, with the effect and
// without it in turns. Usage: velatura_bench_effects [--rounds N] [--spp N] [SCENE.usda…]; without
// scenes the hero scenes that are there.
#include "integrator/effect_plan.h"
#include "parse_options.h"
#include "scene/effect.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

namespace {

using namespace velatura;
using nlohmann::json;
namespace fs = std::filesystem;

/// What one run of the program took.
struct Cost {
    double cpu_s = 0, memory_mib = 0;
};

class Program {
  public:
    Program(fs::path program, int samples) : program_(std::move(program)), samples_(samples) {
        folder_ = fs::temp_directory_path() / fmt::format("velatura_bench_effects_{}", ::getpid());
        fs::create_directories(folder_);
    }

    ~Program() {
        std::error_code ignored;
        fs::remove_all(folder_, ignored);
    }

    Program(const Program&) = delete;
    Program& operator=(const Program&) = delete;

    /// Nothing: it failed. What effects change of how paths divide, what is learned and where
    /// samples go is no part of their price, so these are off.
    std::optional<Cost> render(const std::string& scene, const std::string& effects) const {
        return render(scene, effects, samples_);
    }

    /// The same of one sample per pixel: next to nothing but what comes before the first.
    std::optional<Cost> start(const std::string& scene, const std::string& effects) const {
        return render(scene, effects, 1);
    }

    /// Of the last render.
    json effects() const {
        std::ifstream in(stats_file());
        return json::parse(in).at("effects");
    }

  private:
    std::optional<Cost> render(const std::string& scene,
                               const std::string& effects,
                               int samples) const {
        std::vector<std::string> words = {program_.string(),
                                          "render",
                                          scene,
                                          "-o",
                                          (folder_ / "x.exr").string(),
                                          "--stats",
                                          stats_file().string(),
                                          "--res",
                                          "240",
                                          "135",
                                          "--spp",
                                          std::to_string(samples),
                                          "--threads",
                                          "1",
                                          "--adaptive",
                                          "off",
                                          "--guiding",
                                          "off",
                                          "--splitting",
                                          "off",
                                          "--progress",
                                          "none",
                                          "-q"};
        if (!effects.empty()) words.push_back("--effects=" + effects);
        std::vector<char*> arguments;
        for (std::string& word : words) arguments.push_back(word.data());
        arguments.push_back(nullptr);
        const pid_t child = ::fork();
        if (child == 0) {
            ::execv(arguments[0], arguments.data());
            ::_exit(127);
        }
        int status = 0;
        rusage usage{};
        if (child < 0 || ::wait4(child, &status, 0, &usage) != child || status != 0)
            return std::nullopt;
        const auto seconds = [](const timeval& t) {
            return double(t.tv_sec) + 1e-6 * double(t.tv_usec);
        };
        return Cost{seconds(usage.ru_utime) + seconds(usage.ru_stime),
                    double(usage.ru_maxrss) / 1024.0};
    }

    fs::path stats_file() const { return folder_ / "x.json"; }

    fs::path program_, folder_;
    int samples_;
};

double median(std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2),
                     values.end());
    return values[values.size() / 2];
}

/// The effect and the whole scene in turns; false when a render failed.
bool print_price(const Program& program, const std::string& scene, const json& effect, int rounds) {
    const std::string name = effect.at("name");
    std::vector<double> ratios, saved, at_start, memory;
    for (int i = 0; i < rounds; ++i) {
        const auto with = program.render(scene, ""), without = program.render(scene, "-" + name);
        const auto start_with = program.start(scene, ""),
                   start_without = program.start(scene, "-" + name);
        if (!with || !without || !start_with || !start_without) return false;
        ratios.push_back(with->cpu_s / without->cpu_s);
        saved.push_back(with->cpu_s - without->cpu_s);
        at_start.push_back(start_with->cpu_s - start_without->cpu_s);
        memory.push_back(with->memory_mib - without->memory_mib);
    }
    const auto [min, max] = std::minmax_element(ratios.begin(), ratios.end());
    fmt::print("  {:<20} {:>6.3f} {:>6.3f}-{:.3f} {:>+9.3f} {:>+9.3f} {:>+9.1f} {:>13} {}\n", name,
               median(ratios), *min, *max, median(saved), median(at_start), median(memory),
               effect.value("calls", uint64_t(0)), effect.value("prim", std::string()));
    std::fflush(stdout);
    return true;
}

bool print_scene(const Program& program, const std::string& scene, int rounds) {
    const std::optional<Cost> whole = program.render(scene, "");
    if (!whole) {
        fmt::print(stderr, "error: {} does not render\n", scene);
        return false;
    }
    fmt::print("{}: {:.2f} CPU s, {:.0f} MiB\n", scene, whole->cpu_s, whole->memory_mib);
    fmt::print("  {:<20} {:>6} {:>12} {:>9} {:>9} {:>9} {:>13} {}\n", "effect", "ratio", "rounds",
               "CPU s", "at start", "MiB", "calls", "called for by");
    const json effects = program.effects();
    std::string off;
    for (const json& e : effects) {
        const auto effect = scene::find_effect(e.at("name").get<std::string>());
        if (!effect || scene::info(*effect).kind != scene::EffectKind::Scene) continue;
        if (e.at("state") != "on")
            off += " " + e.at("name").get<std::string>();
        else if (!integrator::can_omit(*effect))
            fmt::print("  {:<20} stays: the scene is built of it\n",
                       e.at("name").get<std::string>());
        else if (!print_price(program, scene, e, rounds))
            return false;
    }
    fmt::print("  off, nothing of it runs:{}\n\n", off);
    return true;
}

}  // namespace

int main(int argc, char** argv) {
    CommandLine app{"What each effect of a scene costs in time and memory"};
    std::vector<std::string> scenes;
    int rounds = 5, samples = 32;
    app.add_option("scenes", scenes, "scenes; without any, the hero scenes that are there");
    app.add_option("--rounds", rounds, "renders with and without each effect").range(1, 99);
    app.add_option("--spp", samples, "samples per pixel").range(1, 1 << 20);
    if (const auto code = bench::parse_options(app, argc, argv)) return *code;
    if (scenes.empty()) {
        for (const char* name :
             {"scenes/atelier/atelier", "scenes/sky/sky", "scenes/tuft/tuft",
              "scenes/transport/glass", "scenes/transport/sheets", "scenes/transport/window",
              "scenes/transport/linked", "scenes/transport/lens", "tests/bench/priced"}) {
            const fs::path file = fs::path(VELATURA_SOURCE_DIR) / (std::string(name) + ".usda");
            if (fs::exists(file)) scenes.push_back(file.string());
        }
    }
    const Program program(fs::canonical("/proc/self/exe").parent_path() / "velatura", samples);
    fmt::print(
        "Renders of 240x135 pixels, {} spp, one thread. ratio: CPU time with the effect over "
        "without, median of {} rounds in turns, and their range; at start: what of the CPU seconds "
        "comes before the second sample.\n\n",
        samples, rounds);
    bool is_good = true;
    for (const std::string& scene : scenes) is_good &= print_scene(program, scene, rounds);
    return is_good ? 0 : 1;
}
