// SPDX-License-Identifier: Apache-2.0
#include "layers/deep_file.h"

#include "base/atomic_file.h"
#include "image/exr_header.h"
#include "image/exr_size.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepFrameBuffer.h>
#include <OpenEXR/ImfDeepScanLineInputPart.h>
#include <OpenEXR/ImfDeepScanLineOutputFile.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfTestFile.h>
#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <numeric>

namespace velatura::layers {

namespace {

struct DeepChannel {
    const char* name;
    float DeepSample::*field;
};

constexpr std::array<DeepChannel, 6> deep_channels = {{{"Z", &DeepSample::z},
                                                       {"ZBack", &DeepSample::z_back},
                                                       {"A", &DeepSample::a},
                                                       {"R", &DeepSample::r},
                                                       {"G", &DeepSample::g},
                                                       {"B", &DeepSample::b}}};

constexpr uint64_t max_samples = uint64_t(1) << 32;

/// One row of pixels for OpenEXR, which wants a pointer per pixel and channel.
class Row {
  public:
    explicit Row(const image::Window& w) : window_(w), counts_(size_t(w.width())) {
        for (auto& p : pointers_) p.resize(size_t(w.width()));
    }

    /// Buffers that stand for whatever row is read or written.
    Imf::DeepFrameBuffer buffer(const Imf::ChannelList& channels) {
        const auto base = [this](auto* first, size_t size) {
            return reinterpret_cast<char*>(first) - std::ptrdiff_t(size) * window_.x0;
        };
        Imf::DeepFrameBuffer buffer;
        buffer.insertSampleCountSlice(
            Imf::Slice(Imf::UINT, base(counts_.data(), sizeof(uint32_t)), sizeof(uint32_t), 0));
        for (size_t c = 0; c < deep_channels.size(); ++c) {
            if (!channels.findChannel(deep_channels[c].name)) continue;
            buffer.insert(deep_channels[c].name,
                          Imf::DeepSlice(Imf::FLOAT, base(pointers_[c].data(), sizeof(char*)),
                                         sizeof(char*), 0, sizeof(DeepSample)));
        }
        return buffer;
    }

    uint32_t* counts() { return counts_.data(); }

    size_t sample_count() const {
        return std::accumulate(counts_.begin(), counts_.end(), size_t(0));
    }

    /// Points at the samples of the row, as many as the counts say.
    void point_at(DeepSample* samples) {
        for (size_t x = 0; x < counts_.size(); ++x) {
            for (size_t c = 0; c < deep_channels.size(); ++c)
                pointers_[c][x] = reinterpret_cast<char*>(&(samples->*deep_channels[c].field));
            samples += counts_[x];
        }
    }

  private:
    image::Window window_;
    std::vector<uint32_t> counts_;
    std::array<std::vector<char*>, deep_channels.size()> pointers_;
};

void write_rows(const std::string& path, const DeepImage& image) {
    Imf::Header header(image::exr_box(image.display), image::exr_box(image.data),
                       image.pixel_aspect_ratio);
    header.setType(Imf::DEEPSCANLINE);
    header.compression() = Imf::ZIPS_COMPRESSION;
    for (const DeepChannel& c : deep_channels)
        header.channels().insert(c.name, Imf::Channel(Imf::FLOAT));
    for (const auto& [name, attribute] : image.attributes)
        image::insert_attribute(header, name, attribute);

    Imf::DeepScanLineOutputFile file(path.c_str(), header);
    Row row(image.data);
    file.setFrameBuffer(row.buffer(header.channels()));
    // One past the end where the last pixels are empty; OpenEXR takes writable samples and leaves
    // them alone
    std::vector<DeepSample> samples;
    const auto width = size_t(image.data.width());
    const DeepSample* next = image.samples.data();
    for (size_t y = 0; y < size_t(image.data.height()); ++y) {
        std::copy_n(image.counts.data() + y * width, width, row.counts());
        samples.assign(next, next + row.sample_count());
        next += samples.size();
        samples.emplace_back();
        row.point_at(samples.data());
        file.writePixels(1);
    }
}

Result<DeepImage> read_rows(const std::string& path) {
    const auto error = [&path](const std::string& why) {
        return Error{"io-open", fmt::format("cannot open {}: {}", path, why)};
    };
    if (auto checked = image::check_headers(path); !checked) return checked.error();
    Imf::MultiPartInputFile whole(path.c_str());
    const Imf::Header& header = whole.header(0);
    if (header.type() != Imf::DEEPSCANLINE) return error("it has no deep scanlines");
    for (const DeepChannel& c : deep_channels) {
        const Imf::Channel* channel = header.channels().findChannel(c.name);
        const bool can_be_missing = std::string_view(c.name) == "ZBack";
        if (channel ? channel->type != Imf::FLOAT : !can_be_missing)
            return error("it has no float channels Z A R G B");
    }
    const uint64_t file_bytes = std::filesystem::file_size(path);
    const auto too_much = [&] {
        return error(fmt::format("{} bytes cannot hold its pixels", file_bytes));
    };
    // Before OpenEXR makes room for them
    if (header.dataWindow().isEmpty() || image::min_bytes_of(header) > file_bytes)
        return too_much();
    Imf::DeepScanLineInputPart file(whole, 0);
    DeepImage image;
    image.data = image::window_of(header.dataWindow());
    image.display = image::window_of(header.displayWindow());
    image.pixel_aspect_ratio = header.pixelAspectRatio();
    image::read_attributes(header, image.attributes);
    Row row(image.data);
    file.setFrameBuffer(row.buffer(header.channels()));
    std::vector<DeepSample> samples;
    for (int y = image.data.y0; y < image.data.y1; ++y) {
        file.readPixelSampleCounts(y);
        image.counts.insert(image.counts.end(), row.counts(), row.counts() + image.data.width());
        const size_t count = row.sample_count();
        if (image.samples.size() + count > max_samples) return error("it has too many samples");
        // Z A R G B, at the least
        if ((image.samples.size() + count) * 5 * sizeof(float) / image::max_expansion(header) >
            file_bytes)
            return too_much();
        samples.assign(count + 1, DeepSample{});
        row.point_at(samples.data());
        file.readPixels(y);
        image.samples.insert(image.samples.end(), samples.begin(), samples.end() - 1);
    }
    if (!header.channels().findChannel("ZBack")) {
        for (DeepSample& s : image.samples) s.z_back = s.z;
    }
    return image;
}

}  // namespace

Result<void> write_deep_file(const std::string& path, const DeepImage& image) {
    return write_atomically(path, [&](const std::string& temporary) -> Result<void> {
        try {
            write_rows(temporary, image);
        } catch (const std::bad_alloc&) {
            throw;
        } catch (const std::exception& e) {
            return Error{"io-write", fmt::format("cannot write {}: {}", path, e.what())};
        }
        const auto written = read_deep_file(temporary);
        if (!written || written->data != image.data || written->counts != image.counts ||
            written->samples != image.samples)
            return Error{"verify-failed", fmt::format("{} differs from what was written", path)};
        return {};
    });
}

Result<DeepImage> read_deep_file(const std::string& path) {
    try {
        return read_rows(path);
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& e) {
        return Error{"io-read", fmt::format("cannot read {}: {}", path, e.what())};
    }
}

bool is_deep_file(const std::string& path) {
    return Imf::isDeepOpenExrFile(path.c_str());
}

}  // namespace velatura::layers
