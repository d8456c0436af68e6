// SPDX-License-Identifier: Apache-2.0
#include "compositor/io/merge.h"

#include "compositor/io/merge_parts.h"
#include "layers/layer_header.h"
#include "layers/stated_stats.h"
#include "layers/sums_part.h"
#include "layers/sums_reader.h"

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

/// The pixels where the samples of a part do not follow those before it.
struct Seam {
    size_t pixels = 0;
    int x = 0, y = 0;  ///< one of them
    accumulate::PixelRecord before, after;
};

/// Errors: "sums-damaged".
Result<Seam> seam_before(const image::Image& strip, const accumulate::SampleSums& before) {
    const auto after = layers::stored_records(strip);
    if (!after) return after.error();
    const image::Window& w = strip.data;
    Seam seam;
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const accumulate::PixelRecord &a = before.record(x, y), &b = (*after)[w.index(x, y)];
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

/// Joins the sums of parts strip by strip: what the samples of one part lack for a node of more
/// samples is only kept for the rows of a strip.
class PartJoiner {
  public:
    PartJoiner(const std::vector<PartHeader>& parts, std::vector<MergeFault>& faults)
        : parts_(parts), faults_(faults), end_(parts.size()) {}

    /// `final_end`: as accumulate::SampleSums has it. Errors: also among the faults.
    Result<accumulate::SampleSums> join(uint64_t final_end, size_t strip_bytes) {
        if (const auto ok = open(); !ok) return ok.error();
        const image::Window window = window_of(parts_);
        Result<accumulate::SampleSums> sums =
            layers::empty_sums(readers_[0].header(), window, final_end);
        if (!sums) return fail(0, damaged(0, sums.error()));
        size_t row_bytes = 1;
        for (const layers::SumsReader& r : readers_) row_bytes = std::max(row_bytes, r.row_bytes());
        const int rows = layers::strip_rows(row_bytes, strip_bytes);
        for (int y = window.y0; y < window.y1; y += rows) {
            for (size_t i = 0; i < end_; ++i) {
                if (const auto ok = add_strip(i, std::min(y + rows, window.y1), *sums); !ok)
                    return ok.error();
            }
        }
        if (const auto ok = check(); !ok) return ok.error();
        return sums;
    }

  private:
    Result<void> open() {
        for (size_t i = 0; i < parts_.size(); ++i) {
            auto reader = layers::SumsReader::open(parts_[i].path);
            if (!reader) return fail(i, reader.error());
            if (reader->header().text(layers::samples_attribute) != parts_[i].samples_text)
                return fail(i,
                            refused(fmt::format("{} changed while it was read", parts_[i].path)));
            if (reader->header().data != parts_[i].part.window)
                return fail(i, refused(fmt::format("{}: its sums have other pixels than its layers",
                                                   parts_[i].path)));
            if (const auto ok = layers::check_sums_header(reader->header()); !ok)
                return fail(i, damaged(i, ok.error()));
            readers_.push_back(std::move(*reader));
        }
        return {};
    }

    /// Rows of a part up to y1. Where they do not follow the samples before them, the parts from
    /// this one on are left out from here on, and seams are counted.
    Result<void> add_strip(size_t i, int y1, accumulate::SampleSums& sums) {
        if (readers_[i].next_row() >= std::min(y1, parts_[i].part.window.y1)) return {};
        const Result<image::Image> strip = readers_[i].read_to(y1);
        if (!strip) return fail(i, strip.error());
        const Result<Seam> found = seam_before(*strip, sums);
        if (!found) return fail(i, damaged(i, found.error()));
        if (const Seam& seam = *found; seam.pixels > 0) {
            if (i + 1 < end_) seam_ = {};
            end_ = i + 1;
            const size_t pixels = seam_.pixels + seam.pixels;
            if (seam_.pixels == 0) seam_ = seam;
            seam_.pixels = pixels;
        }
        if (seam_.pixels > 0 && i + 1 == end_) return {};
        if (const auto added = layers::append_sums(*strip, sums); !added)
            return fail(i, damaged(i, added.error()));
        return {};
    }

    /// Once all rows are there: damage first, which may look like a seam.
    Result<void> check() {
        for (size_t i = 0; i < end_; ++i) {
            const Result<bool> is_intact = readers_[i].is_intact();
            if (!is_intact) return fail(i, is_intact.error());
            if (!*is_intact)
                return fail(i, damaged(i, {"sums-damaged", "the stored sums are damaged"}));
        }
        if (seam_.pixels == 0) return {};
        faults_.push_back(
            seam_fault(seam_, part_before(parts_, end_ - 1, seam_), parts_[end_ - 1]));
        return refused(faults_.back().text);
    }

    Error damaged(size_t i, const Error& why) const {
        return refused(fmt::format("{}: {}", parts_[i].path, why.message));
    }

    Error fail(size_t i, const Error& error) {
        faults_.push_back({"damaged", error.message, {parts_[i].path}, std::nullopt, error.code});
        return error;
    }

    const std::vector<PartHeader>& parts_;
    std::vector<MergeFault>& faults_;
    std::vector<layers::SumsReader> readers_;
    size_t end_;  ///< of the parts that are joined; the last one has the seam
    Seam seam_;
};

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
    report.samples = {parts.front().part.samples.first, parts.front().part.samples.second};
    for (const PartHeader& p : parts)
        report.samples->second = std::max(report.samples->second, p.part.samples.second);
    report.is_complete = std::all_of(parts.begin(), parts.end(),
                                     [](const PartHeader& p) { return p.part.is_complete; });

    // Nodes that no sample will join any more need not be kept apart
    const uint64_t final_end = options.keep_sums ? 0 : end_of_samples(parts);
    const auto sums = PartJoiner(parts, report.faults).join(final_end, options.strip_bytes);
    if (!sums) return sums.error();
    layers::FileInfo info = merged_info(parts, options.keep_sums);
    info.stats_json = layers::stats_of_whole(info.stats_json, *sums);
    return layers::write_layer_file(output, *sums, info);
}

}  // namespace io
}  // namespace velatura::compositor
