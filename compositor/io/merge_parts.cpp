// SPDX-License-Identifier: Apache-2.0
#include "compositor/io/merge_parts.h"

#include "image/window_bounds.h"
#include "layers/strip_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <tuple>
#include <utility>

namespace velatura::compositor {
inline namespace io {

namespace {

using Json = nlohmann::json;

std::string text_of(const SampleRange& range) {
    return fmt::format("{}:{}", range.first, range.second);
}

std::string text_of(const image::Window& w) {
    return fmt::format("{},{} to {},{}", w.x0, w.y0, w.x1, w.y1);
}

/// The samples that a header says a file was to have, and whether it has them; of files that do not
/// say so, those that it has.
void read_range(PartHeader& header) {
    MergePart& part = header.part;
    part.samples = {header.samples.first, header.samples.end};
    const Json state = header.settings.is_object() ? header.settings.value("part", Json()) : Json();
    if (!state.is_object()) return;
    const Json samples = state.value("samples", Json()), complete = state.value("complete", Json());
    if (!samples.is_array() || samples.size() != 2 || !samples[0].is_number_unsigned()) return;
    part.samples.first = samples[0].get<uint64_t>();
    if (samples[1].is_number_unsigned()) part.samples.second = samples[1].get<uint64_t>();
    part.is_complete = complete.is_boolean() && complete.get<bool>();
}

Result<PartHeader> read_part_header(const std::string& path) {
    const Result<layers::StripReader> file = layers::StripReader::open(path);
    if (!file) return file.error();
    const image::Image& image = file->description();
    const Result<layers::LayerHeader> header = layers::read_layer_header(image);
    if (!header)
        return Error{header.error().code, fmt::format("{}: {}", path, header.error().message)};
    PartHeader part;
    part.path = part.part.path = path;
    part.samples = header->samples;
    part.info = layers::file_info_of(image, *header);
    part.part.window = image.data;
    part.display = image.display;
    part.samples_text = image.text(layers::samples_attribute);
    const Json sums = Json::parse(image.text(layers::sums_attribute), nullptr, false);
    if (sums.is_object()) part.layer_set = sums.value("layerSet", Json());
    part.settings = Json::parse(part.info.settings_json, nullptr, false);
    if (part.settings.is_discarded()) part.settings = nullptr;
    read_range(part);
    if (part.settings.is_object())
        for (const Json& name : part.settings.value("lacks", Json::array()))
            if (name.is_string()) part.part.lacks.push_back(name.get<std::string>());
    return part;
}

/// ": --max-depth 4 and 8, halves true and false" of what two objects hold, as JSON pointers
/// without their first slash; empty if they hold the same.
std::string differences(const Json& a, const Json& b) {
    if (!a.is_object() || !b.is_object()) return {};
    const Json flat_a = a.flatten(), flat_b = b.flatten();
    Json all = flat_b;
    all.update(flat_a);
    std::string text;
    const auto value_of = [](const Json& flat, const std::string& key) {
        if (!flat.contains(key)) return std::string("nothing");
        return flat[key].is_string() ? flat[key].get<std::string>() : flat[key].dump();
    };
    for (const auto& [key, value] : all.items()) {
        const std::string in_a = value_of(flat_a, key), in_b = value_of(flat_b, key);
        if (in_a == in_b) continue;
        text += fmt::format("{} {} {} and {}", text.empty() ? ":" : ",",
                            key.substr(std::min<size_t>(1, key.size())), in_a, in_b);
    }
    return text;
}

/// What the file says of its settings, and of its build, which their hash does not cover.
Json named_settings(const PartHeader& part) {
    if (!part.settings.is_object()) return {};
    Json settings = part.settings.value("settings", Json::object());
    if (settings.is_object() && part.settings.contains("build"))
        settings["build"] = part.settings["build"];
    return settings;
}

/// A way in which a file differs from another.
struct Difference {
    std::string kind, text;  ///< the text follows on the names of both files
};

std::string scene_difference(const PartHeader& a, const PartHeader& b) {
    const layers::DifferentLayers layers =
        layers::different_layers(a.info.scene_json, b.info.scene_json);
    if (!layers.a.empty())
        return fmt::format("show different scenes: {} in the first, {} in the second", layers.a,
                           layers.b);
    return fmt::format("show different scenes: the hashes of their layers are {} and {}",
                       a.samples.scene_hash, b.samples.scene_hash);
}

/// Hashes of the files that a render read, by name and, of several of one name, by their order;
/// "missing" of those that it could not open.
std::map<std::string, std::string> files_of(const PartHeader& part) {
    std::map<std::string, std::string> files;
    if (!part.settings.is_object()) return files;
    for (const Json& file : part.settings.value("files", Json::array())) {
        if (!file.is_object()) continue;
        const Json name = file.value("name", Json()), hash = file.value("hash", Json());
        if (!name.is_string()) continue;
        std::string key = name.get<std::string>();
        for (int i = 2; files.contains(key); ++i)
            key = fmt::format("{} ({})", name.get<std::string>(), i);
        files[key] = hash.is_string() ? hash.get<std::string>() : "missing";
    }
    return files;
}

/// "wood.png is missing in the second, sky.exr differs".
std::string different_files(const PartHeader& a, const PartHeader& b) {
    const auto files_a = files_of(a), files_b = files_of(b);
    const auto state = [](const auto& files, const std::string& name) {
        const auto at = files.find(name);
        return at == files.end() ? std::string("missing") : at->second;
    };
    auto all = files_a;
    all.insert(files_b.begin(), files_b.end());
    std::string text;
    for (const auto& [name, hash] : all) {
        const std::string in_a = state(files_a, name), in_b = state(files_b, name);
        if (in_a == in_b) continue;
        const char* const what = in_a == "missing"   ? "is missing in the first"
                                 : in_b == "missing" ? "is missing in the second"
                                                     : "differs";
        text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, what);
    }
    return text;
}

/// All ways in which two files are not parts of one render.
std::vector<Difference> differences_of(const PartHeader& a, const PartHeader& b) {
    std::vector<Difference> found;
    if (a.samples.scene_hash != b.samples.scene_hash)
        found.push_back({"scene", scene_difference(a, b)});
    Json settings_a = named_settings(a), settings_b = named_settings(b);
    if (const std::string files = different_files(a, b); !files.empty()) {
        found.push_back({"files", "were rendered with different files: " + files});
        for (Json* settings : {&settings_a, &settings_b})
            if (settings->is_object()) settings->erase("files");
    }
    if (const std::string settings = differences(settings_a, settings_b); !settings.empty())
        found.push_back({"settings", "were rendered with different settings" + settings});
    if (a.samples.seed != b.samples.seed)
        found.push_back({"seed", fmt::format("have different seeds: {} and {}", a.samples.seed,
                                             b.samples.seed)});
    if (a.display != b.display)
        found.push_back(
            {"window", fmt::format("are of images with different sizes: pixels {} and {}",
                                   text_of(a.display), text_of(b.display))});
    if (a.layer_set != b.layer_set)
        found.push_back(
            {"layers", "store different layers" + differences(a.layer_set, b.layer_set)});
    if (found.empty() && a.samples.settings_hash != b.samples.settings_hash)
        found.push_back(
            {"settings", "were rendered with different settings, which they do not name"});
    return found;
}

/// The first of those that agree with most others.
const PartHeader& usual_part(const std::vector<PartHeader>& parts) {
    const auto key = [](const PartHeader& p) {
        const Json build = p.settings.is_object() ? p.settings.value("build", Json()) : Json();
        return std::tuple(p.samples.scene_hash, p.samples.settings_hash, p.samples.seed,
                          build.dump(), p.layer_set.dump());
    };
    std::map<decltype(key(parts[0])), size_t> counts;
    size_t most = 0;
    for (const PartHeader& part : parts) most = std::max(most, ++counts[key(part)]);
    return *std::find_if(parts.begin(), parts.end(),
                         [&](const PartHeader& part) { return counts[key(part)] == most; });
}

/// "b.exr", "b.exr, c.exr and 29 more".
std::string names_of(const std::vector<std::string>& files) {
    constexpr size_t named = 3;
    std::string text = files[0];
    for (size_t i = 1; i < std::min(files.size(), named); ++i) text += ", " + files[i];
    return files.size() > named ? fmt::format("{} and {} more", text, files.size() - named) : text;
}

void find_differences(const std::vector<PartHeader>& parts, std::vector<MergeFault>& faults) {
    const PartHeader& usual = usual_part(parts);
    std::vector<std::pair<Difference, std::vector<std::string>>> found;
    for (const PartHeader& part : parts) {
        if (&part == &usual) continue;
        for (Difference& d : differences_of(usual, part)) {
            const auto at = std::find_if(found.begin(), found.end(), [&d](const auto& known) {
                return known.first.text == d.text;
            });
            if (at == found.end())
                found.push_back({std::move(d), {part.path}});
            else
                at->second.push_back(part.path);
        }
    }
    for (const auto& [difference, files] : found)
        faults.push_back({difference.kind,
                          fmt::format("{} and {} {}", usual.path, names_of(files), difference.text),
                          files, std::nullopt});
}

/// Whether what a file was to have is a run of whole sample indices, the same in every pixel or so
/// stated by the file.
bool has_known_range(const PartHeader& part) {
    return part.samples.is_uniform || (part.settings.is_object() && part.settings.contains("part"));
}

/// Pixels that the same parts have.
struct Cell {
    image::Window window;
    std::vector<const PartHeader*> parts;  ///< by samples
};

/// Cuts a row of windows, between y0 and y1, where one of them begins or ends.
void add_cells_of_row(int y0,
                      int y1,
                      const image::Window& all,
                      const std::vector<const PartHeader*>& parts,
                      std::vector<Cell>& cells) {
    std::set<int> edges = {all.x0, all.x1};
    std::vector<const PartHeader*> in_row;
    for (const PartHeader* part : parts) {
        const image::Window& w = part->part.window;
        if (w.y0 > y0 || w.y1 < y1) continue;
        in_row.push_back(part);
        edges.insert({w.x0, w.x1});
    }
    for (auto at = edges.begin(); std::next(at) != edges.end(); ++at) {
        Cell cell = {{*at, y0, *std::next(at), y1}, {}};
        for (const PartHeader* part : in_row)
            if (image::contains(part->part.window, cell.window)) cell.parts.push_back(part);
        cells.push_back(std::move(cell));
    }
}

/// The pixels of the smallest window around all parts, by the parts that have them.
std::vector<Cell> cells_of(const std::vector<PartHeader>& parts) {
    const image::Window all = window_of(parts);
    std::set<int> edges = {all.y0, all.y1};
    std::vector<const PartHeader*> pointers;
    for (const PartHeader& part : parts) {
        edges.insert({part.part.window.y0, part.part.window.y1});
        pointers.push_back(&part);
    }
    std::vector<Cell> cells;
    for (auto at = edges.begin(); std::next(at) != edges.end(); ++at) {
        std::vector<Cell> row;
        add_cells_of_row(*at, *std::next(at), all, pointers, row);
        // A cell goes on where the row above has the same parts at the same place
        for (Cell& cell : row) {
            const auto above = std::find_if(cells.begin(), cells.end(), [&cell](const Cell& c) {
                return c.window.y1 == cell.window.y0 && c.window.x0 == cell.window.x0 &&
                       c.window.x1 == cell.window.x1 && c.parts == cell.parts;
            });
            if (above == cells.end())
                cells.push_back(std::move(cell));
            else
                above->window.y1 = cell.window.y1;
        }
    }
    return cells;
}

/// Gaps and overlaps of the samples of a cell, as ranges.
class CellFaults {
  public:
    /// is_all: it is the whole image, which needs no naming.
    CellFaults(const Cell& cell, bool is_all, std::vector<MergeFault>& faults)
        : cell_(cell), is_all_(is_all), faults_(faults) {}

    /// range: what the cell must have; why: of a gap at its ends.
    void find(const SampleRange& range, const char* why) {
        if (cell_.parts.empty()) return add_gap(range.first, range.second, why);
        const PartHeader* farthest = cell_.parts[0];
        for (size_t i = 1; i < cell_.parts.size(); ++i) {
            const PartHeader& part = *cell_.parts[i];
            if (has_known_range(*farthest) && has_known_range(part)) compare(*farthest, part);
            if (part.part.samples.second > farthest->part.samples.second) farthest = &part;
        }
        const uint64_t first = cell_.parts[0]->part.samples.first,
                       end = farthest->part.samples.second;
        if (first > range.first) add_gap(range.first, std::min(first, range.second), why);
        if (end < range.second) add_gap(std::max(end, range.first), range.second, why);
    }

  private:
    void compare(const PartHeader& before, const PartHeader& after) {
        const SampleRange &a = before.part.samples, &b = after.part.samples;
        if (b.first > a.second) add_gap(a.second, b.first, "");
        if (b.first >= a.second) return;
        faults_.push_back({"overlap",
                           fmt::format("overlap: {} has the samples {} and {} has {}{}",
                                       before.path, text_of(a), after.path, text_of(b), where()),
                           {after.path},
                           SampleRange{b.first, std::min(a.second, b.second)},
                           "merge-refused",
                           is_all_ ? std::nullopt : std::optional(cell_.window)});
    }

    void add_gap(uint64_t first, uint64_t end, const char* why) {
        faults_.push_back(
            {"gap",
             fmt::format("gap: no file has the samples {}:{}{}{}", first, end, where(), why),
             {},
             SampleRange{first, end},
             "merge-refused",
             is_all_ ? std::nullopt : std::optional(cell_.window)});
    }

    std::string where() const {
        return is_all_ ? std::string() : fmt::format(" of the pixels {}", text_of(cell_.window));
    }

    const Cell& cell_;
    bool is_all_;
    std::vector<MergeFault>& faults_;
};

/// Gaps, overlaps, and what is missing of the samples expected.
void find_range_faults(const std::vector<PartHeader>& parts,
                       const std::optional<SampleRange>& expected,
                       std::vector<MergeFault>& faults) {
    SampleRange range = parts[0].part.samples;  // of all parts: crops have the same samples
    for (const PartHeader& part : parts)
        range.second = std::max(range.second, part.part.samples.second);
    const std::vector<Cell> cells = cells_of(parts);
    for (const Cell& cell : cells)
        CellFaults(cell, cells.size() == 1, faults)
            .find(expected.value_or(range), expected ? " expected" : "");
    if (!expected) return;
    for (const PartHeader& part : parts) {
        const SampleRange& own = part.part.samples;
        if (own.first < expected->first || own.second > expected->second)
            faults.push_back({"unexpected",
                              fmt::format("{} has the samples {}, expected are {}", part.path,
                                          text_of(own), text_of(*expected)),
                              {part.path},
                              own});
    }
}

/// Takes out of `a` what `b` says otherwise.
void keep_common(nlohmann::ordered_json& a, const nlohmann::ordered_json& b) {
    std::vector<std::string> different;
    for (auto& [key, value] : a.items()) {
        if (b.is_object() && b.contains(key)) {
            if (value == b[key]) continue;
            if (value.is_object() && b[key].is_object()) {
                keep_common(value, b[key]);
                continue;
            }
        }
        different.push_back(key);
    }
    for (const std::string& key : different) a.erase(key);
}

}  // namespace

std::vector<PartHeader> read_part_headers(const std::vector<std::string>& paths,
                                          std::vector<MergeFault>& faults) {
    std::vector<PartHeader> parts;
    for (const std::string& path : paths) {
        Result<PartHeader> part = read_part_header(path);
        if (!part) {
            const Error& error = part.error();
            faults.push_back({"unreadable", error.message, {path}, std::nullopt, error.code});
        } else if (!part->layer_set.is_object()) {
            faults.push_back(
                {"no-sums",
                 fmt::format("{} has no sums to merge; render it with --samples A:B", path),
                 {path},
                 std::nullopt});
        } else {
            parts.push_back(std::move(*part));
        }
    }
    std::stable_sort(parts.begin(), parts.end(), [](const PartHeader& a, const PartHeader& b) {
        const auto place = [](const PartHeader& p) {
            return std::tuple(p.part.samples, p.part.window.y0, p.part.window.x0);
        };
        return place(a) < place(b);
    });
    return parts;
}

image::Window window_of(const std::vector<PartHeader>& parts) {
    image::Window all = parts[0].part.window;
    for (const PartHeader& part : parts) all = image::united(all, part.part.window);
    return all;
}

void find_faults(const std::vector<PartHeader>& parts,
                 const MergeOptions& options,
                 std::vector<MergeFault>& faults) {
    if (parts.empty()) {
        if (faults.empty()) faults.push_back({"nothing", "nothing to merge", {}, std::nullopt});
        return;
    }
    find_differences(parts, faults);
    for (const PartHeader& part : parts) {
        if (part.part.is_complete || options.accepts_incomplete) continue;
        faults.push_back(
            {"incomplete",
             fmt::format("{} is incomplete: it was stopped before it had all of its samples {}; "
                         "continue it with --resume, or merge what it has with --incomplete",
                         part.path, text_of(part.part.samples)),
             {part.path},
             part.part.samples});
    }
    // Of what cannot be read the samples are not known
    const bool is_whole = std::none_of(faults.begin(), faults.end(), [](const MergeFault& f) {
        return f.kind == "unreadable" || f.kind == "no-sums";
    });
    if (is_whole) find_range_faults(parts, options.expected, faults);
}

std::string common_stats(const std::vector<PartHeader>& parts) {
    using Json = nlohmann::ordered_json;
    Json stats = Json::parse(parts[0].info.stats_json, nullptr, false);
    if (!stats.is_object()) return parts[0].info.stats_json;
    for (const PartHeader& part : parts) {
        if (part.part.window == parts[0].part.window) continue;
        Json other = Json::parse(part.info.stats_json, nullptr, false);
        if (other.is_object())
            for (const char* of_sums : {"error", "ledger"})  // measured anew: stats_of_whole()
                if (stats.contains(of_sums)) other[of_sums] = stats[of_sums];
        keep_common(stats, other);
    }
    return stats.dump();
}

uint64_t end_of_samples(const std::vector<PartHeader>& parts) {
    uint64_t end = 0;
    for (const PartHeader& p : parts) end = std::max({end, p.part.samples.second, p.samples.end});
    return end;
}

std::string merged_settings(const std::vector<PartHeader>& parts) {
    auto settings = nlohmann::ordered_json::parse(parts[0].info.settings_json, nullptr, false);
    if (!settings.is_object() || !settings.contains("part")) return parts[0].info.settings_json;
    const PartHeader& last = parts.back();
    const bool is_stated = std::all_of(parts.begin(), parts.end(), [](const PartHeader& p) {
        return p.settings.is_object() && p.settings.contains("part");
    });
    if (!is_stated) {
        settings.erase("part");
        return settings.dump();
    }
    // A file that was to go on until a time or an error states no end
    settings["part"]["samples"][1] = last.settings["part"]["samples"][1];
    settings["part"]["complete"] = std::all_of(
        parts.begin(), parts.end(), [](const PartHeader& p) { return p.part.is_complete; });
    return settings.dump();
}

}  // namespace io
}  // namespace velatura::compositor
