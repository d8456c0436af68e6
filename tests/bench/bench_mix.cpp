// SPDX-License-Identifier: Apache-2.0
// What a mix of a large file costs: 40 half layers of 3840×2160, beside plainly reading the same
// parts with OpenEXR, round by round in one process; and the peak memory of a process that mixes 10
// and 40 layers. Usage: velatura_bench_mix [--size WIDTH HEIGHT] [--rounds N] [--folder DIR]
#include "compositor/io/layer_stack.h"
#include "compositor/mix/mix.h"
#include "cpu_clock.h"
#include "image/exr.h"
#include "layers/layer_file.h"
#include "layers/layer_header.h"
#include "parse_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace {

using namespace velatura;

constexpr int columns = 5;  // b0 b1 b2 b3 tail

struct Size {
    int width = 3840, height = 2160;
};

double wall_seconds() {
    return bench::seconds_of(CLOCK_MONOTONIC);
}

uint32_t hash(uint32_t x) {
    x = (x ^ (x >> 16)) * 0x7feb352du;
    x = (x ^ (x >> 15)) * 0x846ca68bu;
    return x ^ (x >> 16);
}

/// A smooth image under the noise of some 64 samples per pixel, as paths leave it: dark places
/// are noisier, and a tenth of the pixels of every layer are black.
image::Channel noisy_channel(const Size& size, const std::string& name, uint32_t seed) {
    const size_t pixels = size_t(size.width) * size_t(size.height);
    image::Channel channel = image::Channel::make(name, image::ChannelType::Half, pixels);
    auto& values = std::get<std::vector<Imath::half>>(channel.data);
    const float phase = float(hash(seed) & 0xffu);
    for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
            const float u = float(x) / float(size.width), v = float(y) / float(size.height);
            const float smooth = 0.2f + 0.2f * std::sin(9.0f * u + phase) * std::cos(7.0f * v);
            const uint32_t h = hash(seed + hash(uint32_t(y * size.width + x)));
            const float noise = float(h & 0xffffu) / 32768.0f - 1.0f;
            const float value = (h >> 16) % 10 == 0 ? 0.0f : smooth * (1.0f + 0.25f * noise);
            values[size_t(y) * size_t(size.width) + size_t(x)] = value;
        }
    }
    return channel;
}

Result<void> make_file(const std::string& path, const Size& size, int layers) {
    image::Image image;
    image.data = {0, 0, size.width, size.height};
    layers::ResolvedLayers resolved;
    layers::FamilyClosure closure;
    closure.family = "matrix";
    closure.is_exact = true;
    accumulate::LayerSet set;
    image::Part rgba, matrix;
    rgba.name = "rgba";
    matrix.name = "matrix";
    const size_t pixels = image.data.pixel_count();
    for (const char* name : {"R", "G", "B", "A"})
        rgba.channels.push_back(image::Channel::make(name, image::ChannelType::Float, pixels));
    const auto add_entry = [&](const std::string& name, const std::string& bounce,
                               const std::string& group) {
        accumulate::LayerEntry& entry = resolved.layers.emplace_back();
        entry.name = name;
        entry.family = name == "rgba" ? "beauty" : "matrix";
        entry.part = name == "rgba" ? "rgba" : "matrix";
        entry.type = name == "rgba" ? "float" : "half";
        entry.bounce = bounce;
        entry.group = group;
        entry.in_sum = name != "rgba";
    };
    add_entry("rgba", "", "");
    for (int l = 0; l < layers; ++l) {
        const std::string group = fmt::format("light{}", l / columns);
        const std::string bounce =
            l % columns == columns - 1 ? "tail" : fmt::format("b{}", l % columns);
        if (l % columns == 0) set.groups.push_back({group, {}, false});
        const std::string name = bounce + "_" + group;
        for (const char* c : {"R", "G", "B"}) {
            matrix.channels.push_back(noisy_channel(size, name + "." + c, uint32_t(3 * l) + *c));
            auto& beauty = std::get<std::vector<float>>(rgba.channels[*c == 'R'   ? 0
                                                                      : *c == 'G' ? 1
                                                                                  : 2]
                                                            .data);
            image::for_each_value(matrix.channels.back(),
                                  [&](size_t i, float v) { beauty[i] += v; });
        }
        closure.order.push_back(name);
        add_entry(name, bounce, group);
    }
    resolved.closure.push_back(std::move(closure));
    image.parts.push_back(std::move(rgba));
    image.parts.push_back(std::move(matrix));
    layers::FileInfo info;
    info.display = image.data;
    layers::write_layer_header(image, resolved, set, {}, info);
    return image::write_exr(path, image);
}

compositor::Look look_of_all_rows() {
    compositor::Look look;
    for (const char* gain : {"light0=+1st", "indirect=1.5", "light1:b1=0.25"})
        look.controls.push_back(*compositor::parse_control(compositor::Control::Kind::Gain, gain));
    return look;
}

[[noreturn]] void give_up(const Error& error) {
    fmt::print(stderr, "{}\n", error.message);
    std::exit(1);
}

image::Image mix(const std::string& path) {
    const compositor::Look look = look_of_all_rows();
    const auto file = layers::StripReader::open(path);
    if (!file) give_up(file.error());
    const auto layout = compositor::LayerStack::describe(*file, path);
    if (!layout) give_up(layout.error());
    const auto plan = compositor::mix::plan_mix(*layout, look);
    if (!plan) give_up(plan.error());
    auto mixed = compositor::mix::mix_file(*file, *layout, *plan, look, false);
    if (!mixed) give_up(mixed.error());
    return std::move(*mixed);
}

/// All parts, as any program would read them. Returns a value of them.
float read_plainly(const std::string& path) {
    const auto reader = image::ExrReader::open(path);
    if (!reader) give_up(reader.error());
    float sum = 0;
    for (int p = 0; p < reader->part_count(); ++p) {
        const auto part = reader->read_part(p);
        if (!part) give_up(part.error());
        sum += part->channels[0].value(0);
    }
    return sum;
}

struct Times {
    std::vector<double> wall, cpu;

    template <class F>
    void add(F f) {
        const double wall_start = wall_seconds(), cpu_start = bench::cpu_seconds();
        f();
        wall.push_back(wall_seconds() - wall_start);
        cpu.push_back(bench::cpu_seconds() - cpu_start);
    }

    static double median(std::vector<double> v) {
        std::nth_element(v.begin(), v.begin() + std::ptrdiff_t(v.size() / 2), v.end());
        return v[v.size() / 2];
    }

    void print(const char* name, const Times& against) const {
        const double w = median(wall), c = median(cpu);
        fmt::print("{:<28}{:8.2f} s wall {:8.2f} s CPU   ratio {:.2f} wall, {:.2f} CPU\n", name, w,
                   c, w / median(against.wall), c / median(against.cpu));
    }
};

/// Peak resident memory of this process. Not ru_maxrss, which a child inherits from its parent.
double peak_megabytes() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);) {
        if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) / 1024;
    }
    return 0;
}

/// That of a process that mixes the file and writes the result.
double child_megabytes(const std::string& path, const std::string& output) {
    const std::string command =
        fmt::format("'{}' --child '{}' '{}'",
                    std::filesystem::read_symlink("/proc/self/exe").string(), path, output);
    FILE* pipe = popen(command.c_str(), "r");
    double megabytes = 0;
    const bool is_read = pipe && fscanf(pipe, "%lf", &megabytes) == 1;
    if (!pipe || pclose(pipe) != 0 || !is_read) give_up({"child", "the process that mixes failed"});
    return megabytes;
}

}  // namespace

int main(int argc, char** argv) {
    CommandLine app("Mix beside plain reading");
    std::vector<int> size = {3840, 2160};
    std::vector<std::string> child;
    int rounds = 3;
    std::string folder = std::filesystem::temp_directory_path().string();
    app.add_option("--size", size, "Width and height").expected(2);
    app.add_option("--rounds", rounds, "Rounds");
    app.add_option("--folder", folder, "Where the files are made, and kept");
    app.add_option("--child", child, "").expected(2).hidden();
    if (const auto code = bench::parse_options(app, argc, argv)) return *code;
    if (!child.empty()) {
        const auto written = layers::write_image_file(child[1], mix(child[0]));
        if (!written) give_up(written.error());
        fmt::print("{}\n", peak_megabytes());
        return 0;
    }

    const std::string output = folder + "/velatura_bench_mixed.exr";
    std::vector<std::string> files;
    for (const int layers : {10, 40}) {
        files.push_back(
            fmt::format("{}/velatura_bench_{}x{}_{}.exr", folder, size[0], size[1], layers));
        if (std::filesystem::exists(files.back())) continue;
        if (auto made = make_file(files.back(), {size[0], size[1]}, layers); !made)
            give_up(made.error());
    }
    fmt::print("{}×{}, 40 half layers in one part, {:.0f} MB of ZIP\n", size[0], size[1],
               double(std::filesystem::file_size(files[1])) / 1e6);
    Times reading, mixing, writing;
    for (int r = 0; r < rounds; ++r) {
        float sum = 0;
        reading.add([&] { sum += read_plainly(files[1]); });
        image::Image mixed;
        mixing.add([&] { mixed = mix(files[1]); });
        writing.add([&] {
            if (auto written = layers::write_image_file(output, mixed); !written)
                give_up(written.error());
        });
        if (!std::isfinite(sum)) give_up({"sum", "the file is damaged"});
    }
    reading.print("read the parts", reading);
    mixing.print("mix", reading);
    writing.print("write and verify the mix", reading);
    for (size_t f = 0; f < files.size(); ++f) {
        fmt::print("peak memory, {} layers: {:.0f} MB\n", f == 0 ? 10 : 40,
                   child_megabytes(files[f], output));
    }
    std::filesystem::remove(output);
}
