// SPDX-License-Identifier: Apache-2.0
#include "layers/sums_part.h"

#include "base/tasks.h"
#include "image/digest.h"
#include "image/window_bounds.h"
#include "layers/cryptomatte_layers.h"
#include "layers/layer_header.h"
#include "layers/picked_sums.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string_view>

namespace velatura::layers {

namespace {

constexpr std::array<const char*, 6> word_names = {"x0", "x1", "y0", "y1", "z0", "z1"};
constexpr std::array<const char*, 6> record_names = {
    "sums_first", "sums_end", "sums_invalid", "sums_primId", "sums_instanceId", "sums_hasIds"};
constexpr const char* rate_name = "sums_rate";
constexpr std::array<const char*, 3> earlier_names = {"sums_earlierR", "sums_earlierG",
                                                      "sums_earlierB"};
constexpr const char* sums_schema = "velatura.sums/2";
constexpr size_t node_limit = 64;  // of a range of 32-bit numbers

std::string channel_name(size_t node, uint32_t accumulator, size_t word) {
    return fmt::format("sums{}_{}.{}", node, accumulator, word_names[word]);
}

std::array<uint32_t, 6> words_of(const accumulate::Triple& t) {
    std::array<uint32_t, 6> words{};
    const std::array<double, 3> values = {t.x, t.y, t.z};
    for (size_t i = 0; i < 3; ++i) {
        const auto bits = std::bit_cast<uint64_t>(values[i]);
        words[2 * i] = uint32_t(bits);
        words[2 * i + 1] = uint32_t(bits >> 32);
    }
    return words;
}

accumulate::Triple triple_of(const std::array<uint32_t, 6>& words) {
    const auto value = [&words](size_t i) {
        return std::bit_cast<double>(uint64_t(words[2 * i]) | uint64_t(words[2 * i + 1]) << 32);
    };
    return {value(0), value(1), value(2)};
}

using Words = std::vector<uint32_t>;

Error damaged() {
    return {"sums-damaged", "the stored sums are damaged"};
}

/// The values of a bookkeeping channel, one per pixel; null if they are none.
const Words* words_of(const image::Image& image, const image::Channel& channel) {
    const auto* words = std::get_if<Words>(&channel.data);
    return words && words->size() == image.data.pixel_count() ? words : nullptr;
}

/// The records of the pixels, in the order of `record_names`, and the rates and earlier means if
/// there are any.
struct StoredRecords {
    std::array<const Words*, record_names.size()> columns{};
    const Words* rates = nullptr;
    std::array<const Words*, earlier_names.size()> earlier{};

    /// Enters a channel; false if it is none of these.
    bool take(const std::string& name, const Words* words) {
        if (name == rate_name) {
            rates = words;
            return true;
        }
        return enter(record_names, name, words, columns) ||
               enter(earlier_names, name, words, earlier);
    }

    template <size_t Count>
    static bool enter(const std::array<const char*, Count>& names,
                      const std::string& name,
                      const Words* words,
                      std::array<const Words*, Count>& to) {
        const auto at = std::find(names.begin(), names.end(), name);
        if (at == names.end()) return false;
        to[size_t(at - names.begin())] = words;
        return true;
    }

    std::optional<accumulate::EarlierMean> earlier_at(size_t pixel) const {
        if (std::find(earlier.begin(), earlier.end(), nullptr) != earlier.end())
            return std::nullopt;
        accumulate::EarlierMean mean;
        for (size_t c = 0; c < mean.size(); ++c)
            mean[c] = std::bit_cast<float>((*earlier[c])[pixel]);
        if (!std::all_of(mean.begin(), mean.end(), [](float v) { return std::isfinite(v); }))
            return std::nullopt;
        return mean;
    }

    bool is_whole() const {
        return std::find(columns.begin(), columns.end(), nullptr) == columns.end();
    }

    /// Null where the pixel's range is none.
    std::optional<accumulate::PixelRecord> at(size_t pixel) const {
        const auto value = [&](size_t column) { return (*columns[column])[pixel]; };
        accumulate::PixelRecord r;
        r.first = value(0);
        r.end = value(1);
        r.invalid = value(2);
        r.prim_id = value(3);
        r.instance_id = value(4);
        r.has_ids = value(5) != 0;
        r.rate = rates ? uint8_t((*rates)[pixel]) : uint8_t(0);
        if (r.end < r.first) return std::nullopt;
        return r;
    }
};

/// The words of every node of an accumulator, null where a word is 0 in all pixels.
using StoredNodes = std::vector<std::array<const Words*, word_names.size()>>;

/// All bookkeeping channels but those of mattes, found by what their names say: there may be
/// thousands.
struct StoredSums {
    StoredRecords records;
    std::map<uint32_t, StoredNodes> nodes;  ///< by accumulator

    /// Enters a channel `sums<node>_<accumulator>.<word>`; false if that is no node of theirs.
    bool take(const std::string& name, const Words* words, uint32_t accumulators) {
        uint32_t node = 0, accumulator = 0;
        const char *at = name.data() + 4, *const end = name.data() + name.size();
        const auto number = [&](uint32_t& value, char after) {
            const auto parsed = std::from_chars(at, end, value);
            if (parsed.ec != std::errc() || parsed.ptr == end || *parsed.ptr != after) return false;
            at = parsed.ptr + 1;
            return true;
        };
        if (!number(node, '_') || !number(accumulator, '.')) return false;
        const auto word =
            std::find(word_names.begin(), word_names.end(), std::string_view(at, end));
        if (node >= node_limit || accumulator >= accumulators || word == word_names.end())
            return false;
        StoredNodes& of = nodes[accumulator];
        if (of.size() <= node) of.resize(node + 1);
        of[node][size_t(word - word_names.begin())] = words;
        return true;
    }
};

/// Errors: "sums-damaged".
Result<StoredSums> stored_sums(const image::Image& image, uint32_t accumulators) {
    StoredSums stored;
    for (const image::Part& part : image.parts) {
        for (const image::Channel& c : part.channels) {
            if (!image::is_bookkeeping(c.name) || is_matte_sum(c.name) || is_picked_value(c.name))
                continue;
            const Words* words = words_of(image, c);
            if (!words ||
                (!stored.records.take(c.name, words) && !stored.take(c.name, words, accumulators)))
                return damaged();
        }
    }
    if (!stored.records.is_whole()) return damaged();
    return stored;
}

/// Appends the stored samples of one pixel after the other. One per thread.
class PixelReader {
  public:
    explicit PixelReader(const StoredSums& stored) : stored_(stored), sums_(stored.nodes.size()) {}

    /// False where the pixel's range is none, or does not follow the samples that it has.
    bool append(size_t i, int x, int y, accumulate::SampleSums& sums) {
        const auto record = stored_.records.at(i);
        if (!record) return false;
        const accumulate::PixelRecord& before = sums.record(x, y);
        const bool had_none = before.first == before.end;
        if (!had_none && record->first != record->end && record->first != before.end) return false;
        accumulate::DyadicRule(record->first).set_nodes(record->first, record->end, nodes_);
        size_t used = 0;
        for (const auto& [accumulator, nodes] : stored_.nodes) {
            accumulate::NodeSums& s = sums_[used];
            s.accumulator = accumulator;
            s.nodes.resize(nodes_.size());
            bool is_zero = true;
            for (size_t n = 0; n < nodes_.size(); ++n) {
                std::array<uint32_t, 6> words{};
                for (size_t k = 0; n < nodes.size() && k < words.size(); ++k) {
                    if (nodes[n][k]) words[k] = (*nodes[n][k])[i];
                }
                s.nodes[n] = triple_of(words);
                is_zero = is_zero && s.nodes[n].is_zero();
            }
            if (!is_zero) ++used;
        }
        sums.append(x, y, *record, std::span<const accumulate::NodeSums>(sums_.data(), used));
        if (const auto mean = stored_.records.earlier_at(i); mean && had_none)
            sums.set_earlier_mean(x, y, *mean);
        return true;
    }

  private:
    const StoredSums& stored_;
    std::vector<accumulate::NodeSums> sums_;
    std::vector<accumulate::DyadicNode> nodes_;
};

std::string bookkeeping_digest(const image::Image& image) {
    SumsDigest digest(image.data);
    digest.add(image);
    return digest.finish();
}

std::string records_digest(const image::Image& image) {
    std::vector<const image::Channel*> channels;
    for (const image::Part& part : image.parts) {
        for (const image::Channel& c : part.channels) {
            if (is_record(c.name)) channels.push_back(&c);
        }
    }
    return image::digest_of(image.data, std::move(channels));
}

}  // namespace

Result<std::vector<image::Part>> sums_parts(const accumulate::SampleSums& sums) {
    if (sums.final_end() != 0) {
        return Error{"sums-folded",
                     "the sums were folded for a fixed number of samples, so they cannot be stored "
                     "for a merge"};
    }
    const image::Window& w = sums.window();
    const size_t pixels = w.pixel_count();
    std::vector<image::Part> parts;
    for (const char* name : {"sums_records", "sums"}) {
        image::Part part;
        part.name = name;
        part.attributes["colorInteropID"] = std::string("data");
        // Half as large again as with deflate, for a fifth of the time (docs/adr/0072)
        part.compression = image::Compression::Rle;
        parts.push_back(std::move(part));
    }
    image::Part& part = parts[1];
    std::array<std::vector<uint32_t>, 6> records;
    for (auto& r : records) r.resize(pixels);
    std::vector<uint32_t> rates(pixels);
    std::array<std::vector<uint32_t>, 3> earlier;
    for (auto& e : earlier)
        e.assign(pixels, std::bit_cast<uint32_t>(std::numeric_limits<float>::quiet_NaN()));
    bool has_rates = false, has_earlier = false;
    size_t max_nodes = 0;
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const accumulate::PixelRecord& r = sums.record(x, y);
            if (r.end > 0xffffffffull)
                return Error{"sums-range", "sample indices from 2^32 on cannot be stored"};
            const size_t i = w.index(x, y);
            records[0][i] = uint32_t(r.first);
            records[1][i] = uint32_t(r.end);
            records[2][i] = r.invalid;
            records[3][i] = r.prim_id;
            records[4][i] = r.instance_id;
            records[5][i] = r.has_ids ? 1 : 0;
            rates[i] = r.rate;
            has_rates = has_rates || r.rate != 0;
            if (const accumulate::EarlierMean* mean = sums.earlier_mean(x, y)) {
                for (size_t c = 0; c < mean->size(); ++c)
                    earlier[c][i] = std::bit_cast<uint32_t>((*mean)[c]);
                has_earlier = true;
            }
            max_nodes = std::max(max_nodes, sums.nodes_of(x, y).size());
        }
    }
    const auto add_channel = [&parts](const char* name, std::vector<uint32_t>& values) {
        image::Channel channel;
        channel.name = name;
        channel.data = std::move(values);
        parts[0].channels.push_back(std::move(channel));
    };
    for (size_t i = 0; i < records.size(); ++i) add_channel(record_names[i], records[i]);
    if (has_rates) add_channel(rate_name, rates);
    for (size_t c = 0; has_earlier && c < earlier.size(); ++c)
        add_channel(earlier_names[c], earlier[c]);
    for (const uint32_t accumulator : sums.used_accumulators()) {
        for (size_t node = 0; node < max_nodes; ++node) {
            std::array<std::vector<uint32_t>, 6> words;
            for (auto& word : words) word.resize(pixels);
            for (int y = w.y0; y < w.y1; ++y) {
                for (int x = w.x0; x < w.x1; ++x) {
                    const auto split = words_of(sums.node_sum(x, y, accumulator, node));
                    for (size_t k = 0; k < split.size(); ++k) words[k][w.index(x, y)] = split[k];
                }
            }
            for (size_t k = 0; k < words.size(); ++k) {
                if (std::all_of(words[k].begin(), words[k].end(),
                                [](uint32_t v) { return v == 0; }))
                    continue;
                image::Channel channel;
                channel.name = channel_name(node, accumulator, k);
                channel.data = std::move(words[k]);
                part.channels.push_back(std::move(channel));
            }
        }
    }
    if (sums.mattes()) store_matte_sums(*sums.mattes(), w, part);
    if (sums.picks()) store_picked_values(sums, part);
    return parts;
}

bool is_record(std::string_view channel_name) {
    const auto is_it = [&](const char* name) { return channel_name == name; };
    return channel_name == rate_name ||
           std::any_of(record_names.begin(), record_names.end(), is_it) ||
           std::any_of(earlier_names.begin(), earlier_names.end(), is_it);
}

std::string sums_json(const accumulate::LayerSet& set, const image::Image& image) {
    nlohmann::ordered_json j;
    j["schema"] = sums_schema;
    j["layerSet"] = nlohmann::ordered_json::parse(set.to_json());
    j["records"] = records_digest(image);
    j["sha256"] = bookkeeping_digest(image);
    return j.dump();
}

void SumsDigest::add(const image::Image& rows) {
    std::vector<const image::Channel*> channels;
    for (const image::Part& part : rows.parts) {
        for (const image::Channel& c : part.channels) {
            if (image::is_bookkeeping(c.name)) channels.push_back(&c);
        }
    }
    is_empty_ = is_empty_ && channels.empty();
    digest_.add(channels);
}

std::string SumsDigest::finish() {
    return is_empty_ ? std::string() : digest_.finish();
}

bool SumsDigest::is_that_of(const std::string& sums_json) {
    const std::string digest = finish();
    if (digest.empty()) return sums_json.empty();
    const auto j = nlohmann::json::parse(sums_json, nullptr, false);
    return j.is_object() && j.contains("sha256") && j["sha256"] == digest;
}

bool are_sums_intact(const image::Image& image) {
    SumsDigest digest(image.data);
    digest.add(image);
    return digest.is_that_of(image.text(sums_attribute));
}

bool are_records_intact(const image::Image& image) {
    const auto j = nlohmann::json::parse(image.text(sums_attribute), nullptr, false);
    return j.is_object() && j.contains("records") && j["records"] == records_digest(image);
}

Result<std::vector<accumulate::PixelRecord>> stored_records(const image::Image& image) {
    StoredRecords stored;
    for (const image::Part& part : image.parts) {
        for (const image::Channel& c : part.channels) {
            if (is_record(c.name)) stored.take(c.name, words_of(image, c));
        }
    }
    if (!stored.is_whole()) return damaged();
    std::vector<accumulate::PixelRecord> records(image.data.pixel_count());
    for (size_t i = 0; i < records.size(); ++i) {
        const auto record = stored.at(i);
        if (!record) return damaged();
        records[i] = *record;
    }
    return records;
}

Result<void> check_sums_header(const image::Image& header) {
    const std::string text = header.text(sums_attribute);
    if (text.empty()) return Error{"no-sums", "the file is not resumable: it has no sums"};
    const auto j = nlohmann::json::parse(text, nullptr, false);
    if (!j.is_object() || !j.contains("layerSet")) return damaged();
    if (!j.contains("schema") || j["schema"] != sums_schema)
        return Error{"sums-version", "its sums are of another version of Velatura"};
    return {};
}

Result<accumulate::SampleSums> empty_sums(const image::Image& image,
                                          const image::Window& window,
                                          uint64_t final_end) {
    if (const auto ok = check_sums_header(image); !ok) return ok.error();
    const auto j = nlohmann::json::parse(image.text(sums_attribute));
    const auto set = accumulate::LayerSet::from_json(j["layerSet"].dump());
    if (!set) return set.error();
    return accumulate::SampleSums(window, *set, final_end);
}

Result<void> append_sums(const image::Image& image, accumulate::SampleSums& sums) {
    if (!image::contains(sums.window(), image.data)) return damaged();
    const auto stored = stored_sums(image, sums.table().total_count());
    if (!stored) return stored.error();
    const image::Window& w = image.data;
    // Blocks of the tiles of the sums: no two threads use the same
    constexpr int rows = accumulate::SampleSums::tile_size, columns = 8 * rows;
    const int left = sums.window().x0, top = sums.window().y0;
    const int first_row = (w.y0 - top) / rows, end_row = (w.y1 - top + rows - 1) / rows;
    const int first_column = (w.x0 - left) / columns,
              end_column = (w.x1 - left + columns - 1) / columns;
    const size_t across = size_t(end_column - first_column);
    std::atomic<bool> is_damaged = false;
    parallel_for(size_t(end_row - first_row) * across, [&](size_t block) {
        PixelReader reader(*stored);
        const int y0 = top + (first_row + int(block / across)) * rows;
        const int x0 = left + (first_column + int(block % across)) * columns;
        for (int y = std::max(y0, w.y0); y < std::min(y0 + rows, w.y1); ++y) {
            for (int x = std::max(x0, w.x0); x < std::min(x0 + columns, w.x1); ++x) {
                if (is_damaged) return;
                if (!reader.append(w.index(x, y), x, y, sums)) is_damaged = true;
            }
        }
    });
    if (is_damaged) return damaged();
    if (sums.mattes()) {
        if (const Result<void> ok = read_matte_sums(image, sums); !ok) return ok;
    }
    return sums.picks() ? read_picked_values(image, sums) : Result<void>();
}

Result<accumulate::SampleSums> read_sums(const image::Image& image) {
    Result<accumulate::SampleSums> sums = empty_sums(image, image.data);
    if (!sums) return sums;
    if (!are_sums_intact(image)) return damaged();
    if (const Result<void> ok = append_sums(image, *sums); !ok) return ok.error();
    return sums;
}

}  // namespace velatura::layers
