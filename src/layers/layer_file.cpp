// SPDX-License-Identifier: Apache-2.0
#include "layers/layer_file.h"

#include "base/atomic_file.h"
#include "base/tasks.h"
#include "image/channel_index.h"
#include "image/digest.h"
#include "image/exr.h"
#include "layers/cryptomatte.h"
#include "layers/cryptomatte_layers.h"
#include "layers/layer_check.h"
#include "layers/layer_header.h"
#include "layers/layer_image.h"
#include "layers/resolve.h"
#include "layers/strip_reader.h"
#include "layers/sums_part.h"
#include "layers/sums_reader.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <set>

namespace velatura::layers {

namespace {

namespace fs = std::filesystem;

bool has_samples(const accumulate::SampleSums& sums) {
    const image::Window& w = sums.window();
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const accumulate::PixelRecord& r = sums.record(x, y);
            if (r.end > r.first) return true;
        }
    }
    return false;
}

void set_digests(ResolvedLayers& resolved) {
    const auto channels = channels_by_layer(resolved.image);
    parallel_for(resolved.layers.size(), [&](size_t i) {
        accumulate::LayerEntry& e = resolved.layers[i];
        const auto at = channels.find(e.name);
        if (at != channels.end()) e.digest = image::digest_of(resolved.image.data, at->second);
    });
}

/// Puts all channels into one part that every reader finds.
void make_single_part(image::Image& image) {
    image::Part all;
    for (image::Part& part : image.parts) {
        for (image::Channel& c : part.channels) all.channels.push_back(std::move(c));
    }
    image.parts.clear();
    image.parts.push_back(std::move(all));
}

/// Bytes of a value.
size_t value_size(image::ChannelType type) {
    return type == image::ChannelType::Half ? 2 : 4;
}

bool has_same_channels(const image::Part& a, const image::Part& b) {
    if (a.channels.size() != b.channels.size()) return false;
    const image::ChannelIndex named(b);
    return std::all_of(a.channels.begin(), a.channels.end(), [&](const image::Channel& c) {
        const image::Channel* other = named.find(c.name);
        return other && other->type() == c.type();
    });
}

/// Rows of a part that are read back at once: whole chunks that take a few megabytes, as a part may
/// be as large as the film.
int rows_at_once(const image::Part& part, const image::Window& window, int chunk_rows) {
    constexpr size_t bytes_at_once = size_t(32) << 20;
    size_t row_bytes = 1;
    for (const image::Channel& c : part.channels)
        row_bytes += value_size(c.type()) * size_t(window.width());
    const size_t chunks = std::max<size_t>(bytes_at_once / row_bytes / size_t(chunk_rows), 1);
    return int(std::min(chunks * size_t(chunk_rows), size_t(window.height())));
}

/// Whether the file has the values of a part, whose channels it has. Errors: "io-read".
Result<bool> holds_values(const image::ExrReader& reader, int index, const image::Part& part) {
    const image::Window& window = reader.data_window(index);
    const int step = rows_at_once(part, window, reader.rows_per_chunk(index));
    std::vector<std::vector<char>> values;
    std::vector<image::RowTarget> targets;
    for (const image::Channel& c : part.channels) {
        values.emplace_back(value_size(c.type()) * size_t(window.width()) * size_t(step));
        targets.push_back({c.name, c.type(), values.back().data()});
    }
    for (int y0 = window.y0; y0 < window.y1; y0 += step) {
        const int y1 = std::min(y0 + step, window.y1);
        if (const auto read = reader.read_rows(index, y0, y1, targets); !read) return read.error();
        for (size_t i = 0; i < values.size(); ++i) {
            const image::Channel& c = part.channels[i];
            const size_t row = value_size(c.type()) * size_t(window.width());
            const char* meant = static_cast<const char*>(c.bytes()) + row * size_t(y0 - window.y0);
            if (std::memcmp(values[i].data(), meant, row * size_t(y1 - y0)) != 0) return false;
        }
    }
    return true;
}

/// Reads the temporary back, part by part, and compares it with what was meant.
Result<void> verify_written(const std::string& temporary,
                            const std::string& path,
                            const image::Image& image) {
    const auto failed = [&path](const std::string& why) {
        return Error{"verify-failed",
                     fmt::format("{} differs from what was written: {}", path, why)};
    };
    auto reader = image::ExrReader::open(temporary);
    if (!reader) return failed(reader.error().message);
    if (reader->part_count() != int(image.parts.size())) return failed("number of parts");
    if (reader->header().data != image.data) return failed("data window");
    for (const auto& [name, attribute] : image.attributes) {
        const auto at = reader->header().attributes.find(name);
        const bool is_there = at != reader->header().attributes.end();
        const bool is_text = std::holds_alternative<std::string>(attribute);
        if (!is_there || (is_text && at->second != attribute))
            return failed("header attribute " + name);
    }
    for (int i = 0; i < reader->part_count(); ++i) {
        const image::Part& part = image.parts[size_t(i)];
        if (reader->data_window(i) != image.data) return failed("data window of part " + part.name);
        if (!has_same_channels(part, reader->header().parts[size_t(i)]))
            return failed("channels of part " + part.name);
        const Result<bool> is_there = holds_values(*reader, i, part);
        if (!is_there) return failed(is_there.error().message);
        if (!*is_there) return failed("pixels of part " + part.name);
    }
    return {};
}

/// One file per light layer beside the one with the beauty, which lists them.
Result<std::vector<std::string>> write_split(const std::string& path,
                                             image::Image image,
                                             image::Compression compression) {
    const fs::path target(path);
    const auto file_of = [&target](const std::string& layer) {
        return target.stem().string() + "." + layer + target.extension().string();
    };
    std::map<std::string, image::Part> layers;
    std::vector<std::string> order;
    for (image::Part& part : image.parts) {
        // Readers of a Cryptomatte look for all of it in one file
        const bool is_matte = accumulate::is_matte_layer(part.name);
        for (image::Channel& c : part.channels) {
            const bool is_beauty = part.name == "rgba";
            const std::string layer = is_beauty                       ? "rgba"
                                      : image::is_bookkeeping(c.name) ? sums_layer
                                      : is_matte                      ? part.name
                                                 : c.name.substr(0, c.name.find('.'));
            if (layers.count(layer) == 0) order.push_back(layer);
            if (is_matte) layers[layer].attributes = part.attributes;
            // Data stay data in a file of their own
            if (const auto id = part.attributes.find("colorInteropID"); id != part.attributes.end())
                layers[layer].attributes.insert(*id);
            layers[layer].compression = part.compression;
            layers[layer].channels.push_back(std::move(c));
        }
    }
    nlohmann::ordered_json list = nlohmann::ordered_json::object();
    for (const std::string& layer : order) {
        if (layer != "rgba") list[layer] = file_of(layer);
    }
    std::vector<std::string> files;
    const auto write_one = [&](const std::string& file, image::Part part,
                               bool is_main) -> Result<void> {
        image::Image one;
        one.data = image.data;
        one.display = image.display;
        one.pixel_aspect_ratio = image.pixel_aspect_ratio;
        one.attributes = image.attributes;
        if (is_main) {
            one.attributes[split_attribute] = list.dump();
        } else {
            // The strings stand in the main file; a copy in each would only grow old
            std::erase_if(one.attributes, [](const auto& a) {
                return a.first.starts_with("velatura/") || a.first.starts_with("cryptomatte/");
            });
        }
        // One header holds both
        for (const auto& [name, value] : part.attributes) one.attributes.erase(name);
        one.parts.push_back(std::move(part));
        auto written = write_image_file(file, one, compression);
        if (written) files.push_back(file);
        return written;
    };
    const auto write_all = [&]() -> Result<void> {
        for (const std::string& layer : order) {
            if (layer == "rgba") continue;
            const std::string file = (target.parent_path() / file_of(layer)).string();
            if (auto written = write_one(file, std::move(layers[layer]), false); !written)
                return written;
        }
        return write_one(path, std::move(layers["rgba"]), true);
    };
    const auto remove_all = [&] {
        for (const std::string& f : files) fs::remove(f);
    };
    try {
        if (const Result<void> written = write_all(); !written) {
            remove_all();
            return written.error();
        }
    } catch (...) {
        remove_all();
        throw;
    }
    return files;
}

}  // namespace

Result<void> write_image_file(const std::string& path,
                              const image::Image& image,
                              image::Compression compression) {
    return write_atomically(path, [&](const std::string& temporary) -> Result<void> {
        if (auto written = image::write_exr(temporary, image, compression); !written) {
            // Name the file that was asked for, not the temporary
            std::string why = written.error().message;
            if (const size_t at = why.find(temporary); at != std::string::npos)
                why.replace(at, temporary.size(), path);
            return Error{written.error().code, why};
        }
        return verify_written(temporary, path, image);
    });
}

Result<LayerImage> make_layer_image(const accumulate::SampleSums& sums,
                                    const FileInfo& info,
                                    bool is_verified) {
    if (!has_samples(sums)) return Error{"no-samples", "no samples"};
    ResolvedLayers resolved = resolve_layers(sums);
    if (!resolved.first_failure.empty()) return Error{"closure-failed", resolved.first_failure};
    add_cryptomattes(sums, info.matte_names, resolved);
    if (is_verified) set_digests(resolved);
    LayerImage made;
    made.image = std::move(resolved.image);
    image::Image& image = made.image;
    if (info.store_sums) {
        auto parts = sums_parts(sums);
        if (!parts) return parts.error();
        for (image::Part& part : *parts) image.parts.push_back(std::move(part));
        image.attributes[sums_attribute] = sums_json(sums.layer_set(), image);
    }
    if (info.layout == Layout::SinglePart) {
        make_single_part(image);
        for (accumulate::LayerEntry& e : resolved.layers) e.part.clear();
    }
    write_layer_header(image, resolved, sums.layer_set(), sample_info(sums, info), info);

    if (!is_verified) return made;
    // Run the same check that `velatura-comp verify` runs on the file
    const auto header = read_layer_header(image);
    if (!header) return Error{"verify-failed", header.error().message};
    const LayerCheck check = check_layers(image, *header);
    if (!check.is_good()) return Error{"closure-failed", check.problems[0]};

    WriteReport& report = made.report;
    report.sha256 = image::digest_of(image);
    report.layers = check.layers;
    report.channels = check.channels;
    report.float_layers = resolved.overflowed;
    report.closure_family = resolved.closure.empty() ? "none" : resolved.closure[0].family;
    report.storage_error = resolved.storage_error;
    for (const FamilyClosure& c : resolved.closure) {
        report.closure_measured = std::max(report.closure_measured, c.measured);
        report.closure_absolute = std::max(report.closure_absolute, c.measured_absolute);
    }
    return made;
}

Result<WriteReport> write_layer_file(const std::string& path,
                                     const accumulate::SampleSums& sums,
                                     const FileInfo& info) {
    Result<LayerImage> made = make_layer_image(sums, info);
    if (!made) {
        Error error = made.error();
        if (error.code == "no-samples")
            error.message = fmt::format("nothing to write to {}: no samples", path);
        else if (error.code == "closure-failed")
            error.message = fmt::format("{} was not written: {}", path, error.message);
        return error;
    }
    WriteReport& report = made->report;
    if (info.layout == Layout::Split) {
        auto files = write_split(path, std::move(made->image), info.compression);
        if (!files) return files.error();
        report.files = std::move(*files);
    } else {
        if (auto written = write_image_file(path, made->image, info.compression); !written)
            return written.error();
        report.files.push_back(path);
    }
    return std::move(report);
}

Result<std::vector<SplitLayer>> split_layers(const std::string& path, const image::Image& header) {
    const std::string split = header.text(split_attribute);
    std::vector<SplitLayer> layers;
    if (split.empty()) return layers;
    const auto list = nlohmann::json::parse(split, nullptr, false);
    if (!list.is_object())
        return Error{"io-read", fmt::format("cannot read {}: velatura/split is damaged", path)};
    for (const auto& [layer, file] : list.items()) {
        // Only names beside the file itself, never a path out of its folder
        const fs::path name =
            file.is_string() ? fs::path(file.get<std::string>()).filename() : fs::path();
        layers.push_back({layer, (fs::path(path).parent_path() / name).string()});
    }
    return layers;
}

/// Enters all names, and returns one that was there, if any.
std::string SplitChannels::add(const image::Image& file) {
    std::string twice;
    for (const image::Part& part : file.parts) {
        for (const image::Channel& c : part.channels)
            if (!names_.insert(c.name).second) twice = c.name;
    }
    return twice;
}

Result<void> SplitChannels::add(const std::string& path, const image::Image& file) {
    const auto error = [&path](const std::string& why) {
        return Error{"io-read", fmt::format("cannot read {}: {}", path, why)};
    };
    if (file.parts.size() != 1)
        return error(fmt::format("a file of a split layout has one part, this one has {}",
                                 file.parts.size()));
    if (const std::string twice = add(file); !twice.empty())
        return error(fmt::format("another file of the layout has channel {}, too", twice));
    return {};
}

Result<image::Image> read_layer_file(const std::string& path) {
    const auto reader = StripReader::open(path);
    if (!reader) return reader.error();
    return reader->read_all();
}

}  // namespace velatura::layers
