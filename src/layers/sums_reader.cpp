// SPDX-License-Identifier: Apache-2.0
#include "layers/sums_reader.h"

#include "image/digest.h"
#include "image/exr.h"
#include "layers/layer_file.h"
#include "layers/layer_header.h"
#include "layers/sums_part.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>
#include <vector>

namespace velatura::layers {

namespace {

/// The part with its bookkeeping channels alone.
image::Part sums_of(image::Part part) {
    std::erase_if(part.channels,
                  [](const image::Channel& c) { return !image::is_bookkeeping(c.name); });
    return part;
}

Error cannot_read(const std::string& path, const std::string& why) {
    return {"io-read", fmt::format("cannot read {}: {}", path, why)};
}

}  // namespace

struct SumsReader::Impl {
    /// A part of a file, of which `header.parts` has one at the same place.
    struct Place {
        std::string path;
        int part = 0;
    };

    std::string path;
    image::Image header;
    std::vector<Place> places;
    SumsDigest digest;
    int next_row = 0;

    Impl(std::string file, image::Image description)
        : path(std::move(file)),
          header(std::move(description)),
          digest(header.data),
          next_row(header.data.y0) {}

    Result<void> add_parts(const std::string& file, const image::ExrReader& reader) {
        for (int i = 0; i < reader.part_count(); ++i) {
            image::Part part = sums_of(reader.header().parts[size_t(i)]);
            if (part.channels.empty()) continue;
            if (reader.data_window(i) != header.data)
                return cannot_read(file, "the data window of its sums differs");
            header.parts.push_back(std::move(part));
            places.push_back({file, i});
        }
        return {};
    }

    /// The part of that place over some rows, with those of its channels that are wanted.
    Result<image::Part> read(
        size_t place,
        const image::Window& rows,
        bool (*is_wanted)(std::string_view) = [](std::string_view) { return true; }) const {
        const auto reader = image::ExrReader::open(places[place].path);
        if (!reader) return reader.error();
        const image::Part& expected = header.parts[place];
        const int index = places[place].part;
        const auto changed = [&] {
            return cannot_read(places[place].path, "it has changed since it was opened");
        };
        if (index >= reader->part_count() || reader->data_window(index) != header.data ||
            (places[place].path == path &&
             reader->header().text(samples_attribute) != header.text(samples_attribute)))
            return changed();
        const image::Part found = sums_of(reader->header().parts[size_t(index)]);
        const auto is_same = [](const image::Channel& a, const image::Channel& b) {
            return a.name == b.name && a.type() == b.type();
        };
        if (!std::equal(found.channels.begin(), found.channels.end(), expected.channels.begin(),
                        expected.channels.end(), is_same))
            return changed();
        image::Part part = expected;
        std::erase_if(part.channels, [&](const image::Channel& c) { return !is_wanted(c.name); });
        if (part.channels.empty()) return part;
        std::vector<image::RowTarget> targets;
        for (image::Channel& c : part.channels) {
            c = image::Channel::make(c.name, c.type(), rows.pixel_count());
            targets.push_back({c.name, c.type(), c.bytes()});
        }
        if (const auto ok = reader->read_rows(index, rows.y0, rows.y1, targets); !ok)
            return ok.error();
        return part;
    }
};

SumsReader::SumsReader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

SumsReader::~SumsReader() = default;
SumsReader::SumsReader(SumsReader&&) noexcept = default;
SumsReader& SumsReader::operator=(SumsReader&&) noexcept = default;

Result<SumsReader> SumsReader::open(const std::string& path) {
    const auto reader = image::ExrReader::open(path);
    if (!reader) return reader.error();
    image::Image header = reader->header();
    header.parts.clear();
    auto impl = std::make_unique<Impl>(path, std::move(header));
    if (const auto ok = impl->add_parts(path, *reader); !ok) return ok.error();
    const auto layers = split_layers(path, impl->header);
    if (!layers) return layers.error();
    for (const SplitLayer& split : *layers) {
        if (split.layer != sums_layer) continue;
        const auto beside = image::ExrReader::open(split.path);
        if (!beside) return beside.error();
        if (const auto ok = impl->add_parts(split.path, *beside); !ok) return ok.error();
    }
    return SumsReader(std::move(impl));
}

const image::Image& SumsReader::header() const {
    return impl_->header;
}

size_t SumsReader::row_bytes() const {
    size_t channels = 0;
    for (const image::Part& part : impl_->header.parts) channels += part.channels.size();
    return channels * size_t(impl_->header.data.width()) * sizeof(uint32_t);
}

int SumsReader::next_row() const {
    return impl_->next_row;
}

Result<image::Image> SumsReader::read_to(int y1) {
    image::Image strip;
    strip.display = impl_->header.display;
    strip.data = impl_->header.data;
    strip.attributes = impl_->header.attributes;
    strip.data.y0 = impl_->next_row;
    strip.data.y1 = std::clamp(y1, impl_->next_row, impl_->header.data.y1);
    if (strip.data.is_empty()) return strip;
    for (size_t i = 0; i < impl_->places.size(); ++i) {
        auto part = impl_->read(i, strip.data);
        if (!part) return part.error();
        strip.parts.push_back(std::move(*part));
    }
    impl_->digest.add(strip);
    impl_->next_row = strip.data.y1;
    return strip;
}

Result<std::vector<accumulate::PixelRecord>> SumsReader::records() const {
    if (const auto ok = check_sums_header(impl_->header); !ok) return ok.error();
    image::Image image = impl_->header;
    for (size_t i = 0; i < impl_->places.size(); ++i) {
        auto part = impl_->read(i, image.data, is_record);
        if (!part) return part.error();
        image.parts[i] = std::move(*part);
    }
    if (!are_records_intact(image)) return Error{"sums-damaged", "the stored sums are damaged"};
    return stored_records(image);
}

Result<bool> SumsReader::is_intact() {
    const int rows = strip_rows(row_bytes());
    while (impl_->next_row < impl_->header.data.y1) {
        if (const auto strip = read_to(impl_->next_row + rows); !strip) return strip.error();
    }
    return impl_->digest.is_that_of(impl_->header.text(sums_attribute));
}

int strip_rows(size_t row_bytes, size_t strip_bytes) {
    constexpr int tile = accumulate::SampleSums::tile_size;
    constexpr size_t most_tiles = 1024;
    size_t tiles = strip_bytes / (std::max(row_bytes, size_t(1)) * size_t(tile));
    tiles = std::clamp(tiles, size_t(1), most_tiles);
    // PIZ compresses 32 rows together
    if (tiles > 1) tiles -= tiles % 2;
    return int(tiles) * tile;
}

Result<std::vector<uint64_t>> read_sample_counts(const std::string& path) {
    const auto reader = SumsReader::open(path);
    if (!reader) return reader.error();
    const auto records = reader->records();
    if (!records) return records.error();
    std::vector<uint64_t> counts;
    for (const accumulate::PixelRecord& record : *records)
        counts.push_back(record.end - record.first);
    return counts;
}

Result<accumulate::SampleSums> read_sums(SumsReader& reader) {
    Result<accumulate::SampleSums> sums = empty_sums(reader.header(), reader.header().data);
    if (!sums) return sums;
    const int rows = strip_rows(reader.row_bytes());
    Result<void> appended;
    while (appended && reader.next_row() < reader.header().data.y1) {
        const Result<image::Image> strip = reader.read_to(reader.next_row() + rows);
        if (!strip) return strip.error();
        appended = append_sums(*strip, *sums);
    }
    if (!appended) return appended.error();
    const Result<bool> is_intact = reader.is_intact();
    if (!is_intact) return is_intact.error();
    if (!*is_intact) return Error{"sums-damaged", "the stored sums are damaged"};
    return sums;
}

}  // namespace velatura::layers
