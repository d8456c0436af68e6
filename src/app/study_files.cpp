// SPDX-License-Identifier: Apache-2.0
#include "app/study_renderer.h"
#include "image/exr.h"
#include "integrator/schedule.h"
#include "statistics/relative_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>

namespace velatura::app {

namespace {

/// [pixel][3] of the beauty as a reader finds it: what the stored layers add up to.
std::vector<float> stored_beauty(const std::string& path) {
    std::vector<float> values;
    const Result<image::Image> file = image::read_exr(path);
    if (!file) return values;
    const image::Channel* channels[] = {file->find("R"), file->find("G"), file->find("B")};
    if (std::find(std::begin(channels), std::end(channels), nullptr) != std::end(channels))
        return values;
    for (size_t i = 0; i < channels[0]->size(); ++i)
        for (const image::Channel* c : channels) values.push_back(c->value(i));
    return values;
}

double relative_difference(const std::vector<float>& values, const std::vector<float>& reference) {
    if (values.empty() || values.size() != reference.size()) return 0;
    double sum = 0;
    for (size_t i = 0; i < values.size(); ++i) {
        const double d = double(values[i]) - double(reference[i]);
        sum += statistics::relative_square(d * d, double(reference[i]));
    }
    return std::sqrt(sum / double(values.size()));
}

}  // namespace

std::vector<study::FileFormat> StudyRenderer::measure_files(const study::RenderRequest& part,
                                                            const std::string& folder) {
    std::vector<study::FileFormat> files;
    const Result<std::shared_ptr<const Prepared>> prepared = prepare(part.options);
    if (!prepared) return files;
    const Prepared& p = **prepared;
    const double scale = double(window_.pixel_count()) / double(part.grid.pixels());
    const std::string path = (std::filesystem::path(folder) / ".file.exr").string();
    std::vector<float> beauties[2];
    for (const bool is_float : {false, true}) {
        film::LayerSet layers = p.renderer->layers();
        layers.float_layers = is_float;
        film::Film film({0, 0, part.grid.width, part.grid.height}, layers,
                        {.final_sample_end = integrator::max_samples(schedule_of(p, part))});
        if (!render_into(film, p, part)) break;
        for (const auto& [name, compression] : image::compression_table) {
            layers::FileInfo info;
            info.display = {0, 0, part.grid.width, part.grid.height};
            info.compression = compression;
            const bool is_late = std::chrono::steady_clock::now() > part.deadline;
            const std::clock_t start = std::clock();
            if (is_late || !film.write(path, info)) break;
            const double seconds = double(std::clock() - start) / CLOCKS_PER_SEC;
            std::error_code error;
            const double bytes = double(std::filesystem::file_size(path, error));
            const bool is_now =
                is_float == p.job.settings.layers.float_layers && compression == p.job.compression;
            files.push_back({fmt::format("{}, {}", is_float ? "float" : "half", name),
                             bytes * scale, seconds * scale, 0.0, is_now});
            if (beauties[is_float].empty()) beauties[is_float] = stored_beauty(path);
        }
    }
    // What is packed without loss differs by nothing but the rounding of halves
    const double rounding = relative_difference(beauties[0], beauties[1]);
    for (size_t i = 0; i < std::min(files.size(), image::compression_table.size()); ++i)
        files[i].error = rounding;
    std::error_code error;
    std::filesystem::remove(path, error);
    return files;
}

}  // namespace velatura::app
