// SPDX-License-Identifier: Apache-2.0
#include "compositor/io/merge.h"

#include "compositor/io/merge_parts.h"
#include "layers/layer_header.h"
#include "layers/stated_stats.h"
#include "layers/sums_part.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

namespace velatura::compositor {
inline namespace io {

namespace {

Error refused(const std::string& why) {
    return {"merge-refused", why};
}

/// The sums of a part as stored, if it still is the file whose header was read. Errors: of reading,
/// "merge-refused".
Result<image::Image> read_part_sums(const PartHeader& part) {
    Result<image::Image> file = layers::read_sums_image(part.path);
    if (file && file->text(layers::samples_attribute) != part.samples_text)
        return refused(fmt::format("{} changed while it was read", part.path));
    return file;
}

/// The pixels where the samples of a part do not follow those before it.
struct Seam {
    size_t pixels = 0;
    int x = 0, y = 0;  ///< one of them
    accumulate::PixelRecord before, after;
};

Seam seam_of(const accumulate::SampleSums& before,
             const std::vector<accumulate::PixelRecord>& after,
             const image::Window& w) {
    Seam seam;
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const accumulate::PixelRecord &a = before.record(x, y), &b = after[w.index(x, y)];
            const bool is_first = a.first == 0 && a.end == 0;
            if (is_first || a.end == b.first || b.first == b.end) continue;
            if (seam.pixels++ == 0) seam = {1, x, y, a, b};
        }
    }
    return seam;
}

/// Of two parts whose headers go together.
MergeFault seam_fault(const Seam& seam, const PartHeader& before, const PartHeader& after) {
    const size_t pixels = after.part.window.pixel_count();
    const bool is_overlap = seam.after.first < seam.before.end;
    const std::string why =
        before.part.is_complete
            ? ""
            : fmt::format("; {} is incomplete, and only the last part can be", before.part.path);
    return {is_overlap ? "overlap" : "gap",
            fmt::format("{}: in {} of {} pixels the samples of {} do not follow those of {}, e.g. "
                        "pixel {},{} has samples {}:{} and {}:{}{}",
                        is_overlap ? "overlap" : "gap", seam.pixels, pixels, after.path,
                        before.path, seam.x, seam.y, seam.before.first, seam.before.end,
                        seam.after.first, seam.after.end, why),
            {before.part.is_complete ? after.path : before.path},
            std::nullopt};
}

/// The last one before a part that has the pixel of the seam.
const PartHeader& part_before(const std::vector<PartHeader>& parts, size_t part, const Seam& seam) {
    size_t before = part - 1;
    while (before > 0 && !parts[before].part.window.contains(seam.x, seam.y)) --before;
    return parts[before];
}

/// Adds one part after the other, of which one at a time is in memory beside the sums. Errors: also
/// among the faults.
Result<accumulate::SampleSums> joined_sums(const std::vector<PartHeader>& parts,
                                           std::vector<MergeFault>& faults) {
    std::optional<accumulate::SampleSums> sums;
    const auto fail = [&faults](const PartHeader& part, const Error& error) {
        faults.push_back({"damaged", error.message, {part.path}, std::nullopt, error.code});
        return error;
    };
    for (size_t i = 0; i < parts.size(); ++i) {
        const PartHeader& part = parts[i];
        const Result<image::Image> file = read_part_sums(part);
        if (!file) return fail(part, file.error());
        const auto damaged = [&](const Error& why) {
            return fail(part, refused(fmt::format("{}: {}", part.path, why.message)));
        };
        if (!sums) {
            Result<accumulate::SampleSums> empty = layers::empty_sums(*file, window_of(parts));
            if (!empty) return damaged(empty.error());
            sums = std::move(*empty);
        } else {
            const auto records = layers::stored_records(*file);
            if (!records) return damaged(records.error());
            if (const Seam seam = seam_of(*sums, *records, file->data); seam.pixels > 0) {
                faults.push_back(seam_fault(seam, part_before(parts, i, seam), part));
                return refused(faults.back().text);
            }
        }
        if (const Result<void> added = layers::append_sums(*file, *sums); !added)
            return damaged(added.error());
    }
    return std::move(*sums);
}

Error error_of(const std::vector<MergeFault>& faults) {
    std::string text, code = faults[0].code;
    for (const MergeFault& fault : faults) {
        text += (text.empty() ? "" : "\n") + fault.text;
        if (fault.code == "merge-refused") code = fault.code;
    }
    return {code, text};
}

/// What the merged file says beside its pixels.
layers::FileInfo merged_info(const std::vector<PartHeader>& parts, bool keep_sums) {
    layers::FileInfo info = parts[0].info;
    info.store_sums = keep_sums;
    info.settings_json = merged_settings(parts);
    info.stats_json = common_stats(parts);
    for (size_t i = 1; i < parts.size(); ++i) {
        const layers::FileInfo& other = parts[i].info;
        info.bad_samples.insert(info.bad_samples.end(), other.bad_samples.begin(),
                                other.bad_samples.end());
        for (size_t k = 0; k < info.matte_names.size(); ++k) {
            const std::vector<std::string>& names = other.matte_names[k];
            info.matte_names[k].insert(info.matte_names[k].end(), names.begin(), names.end());
        }
    }
    std::sort(info.bad_samples.begin(), info.bad_samples.end(), [](const auto& a, const auto& b) {
        return std::tie(a.sample, a.y, a.x) < std::tie(b.sample, b.y, b.x);
    });
    if (info.bad_samples.size() > 16) info.bad_samples.resize(16);
    return info;
}

}  // namespace

Result<layers::WriteReport> merge_files(const std::vector<std::string>& inputs,
                                        const std::string& output,
                                        const MergeOptions& options,
                                        MergeReport& report) {
    report = {};
    const std::vector<PartHeader> parts = read_part_headers(inputs, report.faults);
    for (const PartHeader& part : parts) report.parts.push_back(part.part);
    find_faults(parts, options, report.faults);
    if (!report.faults.empty()) return error_of(report.faults);
    report.samples = {parts.front().part.samples.first, parts.back().part.samples.second};
    report.is_complete = std::all_of(parts.begin(), parts.end(),
                                     [](const PartHeader& p) { return p.part.is_complete; });

    const Result<accumulate::SampleSums> sums = joined_sums(parts, report.faults);
    if (!sums) return sums.error();
    layers::FileInfo info = merged_info(parts, options.keep_sums);
    info.stats_json = layers::stats_of_whole(info.stats_json, *sums);
    return layers::write_layer_file(output, *sums, info);
}

}  // namespace io
}  // namespace velatura::compositor
