// SPDX-License-Identifier: Apache-2.0
#include "image/exr.h"

#include "base/process/memory_limit.h"
#include "base/tasks.h"
#include "image/exr_header.h"
#include "image/exr_size.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfThreading.h>
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <mutex>
#include <new>
#include <string_view>

namespace velatura::image {

namespace {

constexpr size_t max_pixels = size_t(1) << 30;

std::once_flag threads_started;

void start_exr_threads() {
    std::call_once(threads_started, [] {
        const MemoryLimit::Suspension for_their_stacks;
        Imf::setGlobalThreadCount(std::max(1, thread_count()));
    });
}

/// Want of memory is no error of a file. Of some allocations that fail OpenEXR tells in words.
void throw_if_memory(const std::exception& e) {
    const bool is_told =
        std::string_view(e.what()).find("Failed to allocate") != std::string_view::npos;
    if (is_told || dynamic_cast<const std::bad_alloc*>(&e)) throw std::bad_alloc();
}

Imf::PixelType pixel_type(ChannelType type) {
    switch (type) {
        case ChannelType::Half:
            return Imf::HALF;
        case ChannelType::Float:
            return Imf::FLOAT;
        case ChannelType::Uint:
            return Imf::UINT;
    }
    return Imf::FLOAT;
}

ChannelType channel_type(Imf::PixelType type) {
    if (type == Imf::HALF) return ChannelType::Half;
    return type == Imf::UINT ? ChannelType::Uint : ChannelType::Float;
}

bool is_on_every_part(const Attribute& attribute) {
    return std::holds_alternative<Matrix44>(attribute) ||
           std::holds_alternative<Chromaticities>(attribute);
}

Imf::FrameBuffer frame_buffer(Part& part, const Window& w) {
    Imf::FrameBuffer buffer;
    for (Channel& c : part.channels) {
        const size_t size = c.type() == ChannelType::Half ? 2 : 4;
        buffer.insert(c.name, Imf::Slice::Make(pixel_type(c.type()), c.bytes(), exr_box(w), size,
                                               size * size_t(w.width())));
    }
    return buffer;
}

Imf::Compression exr_compression(Compression compression) {
    switch (compression) {
        case Compression::None:
            return Imf::NO_COMPRESSION;
        case Compression::Rle:
            return Imf::RLE_COMPRESSION;
        case Compression::Zips:
            return Imf::ZIPS_COMPRESSION;
        case Compression::Zip:
            return Imf::ZIP_COMPRESSION;
        case Compression::Piz:
            return Imf::PIZ_COMPRESSION;
    }
    return Imf::ZIP_COMPRESSION;
}

/// Of those that change floats.
bool is_lossy(Imf::Compression compression) {
    return compression == Imf::PXR24_COMPRESSION || compression == Imf::DWAA_COMPRESSION ||
           compression == Imf::DWAB_COMPRESSION;
}

std::vector<Imf::Header> headers_of(const Image& image, Compression compression) {
    std::vector<Imf::Header> headers;
    for (const Part& part : image.parts) {
        Imf::Header header(exr_box(image.display), exr_box(image.data), image.pixel_aspect_ratio);
        header.compression() = exr_compression(compression == Compression::None
                                                   ? compression
                                                   : part.compression.value_or(compression));
        for (const auto& [name, attribute] : image.attributes) {
            if (headers.empty() || is_on_every_part(attribute))
                insert_attribute(header, name, attribute);
        }
        for (const auto& [name, attribute] : part.attributes)
            insert_attribute(header, name, attribute);
        for (const Channel& c : part.channels)
            header.channels().insert(c.name, Imf::Channel(pixel_type(c.type())));
        if (image.parts.size() > 1) {
            header.setName(part.name);
            header.setType(Imf::SCANLINEIMAGE);
        }
        headers.push_back(std::move(header));
    }
    return headers;
}

}  // namespace

Result<void> write_exr(const std::string& path, const Image& image, Compression compression) {
    start_exr_threads();
    try {
        const std::vector<Imf::Header> headers = headers_of(image, compression);
        // OpenEXR takes writable slices for reading and writing alike; it does not change them here
        std::vector<Part>& parts = const_cast<Image&>(image).parts;
        if (parts.size() == 1) {
            Imf::OutputFile file(path.c_str(), headers[0]);
            file.setFrameBuffer(frame_buffer(parts[0], image.data));
            file.writePixels(image.data.height());
            return {};
        }
        Imf::MultiPartOutputFile file(path.c_str(), headers.data(), int(headers.size()));
        for (size_t i = 0; i < parts.size(); ++i) {
            Imf::OutputPart part(file, int(i));
            part.setFrameBuffer(frame_buffer(parts[i], image.data));
            part.writePixels(image.data.height());
        }
        return {};
    } catch (const std::exception& e) {
        throw_if_memory(e);
        return Error{"io-write", fmt::format("cannot write {}: {}", path, e.what())};
    }
}

void use_one_exr_thread() {
    start_exr_threads();
    Imf::setGlobalThreadCount(0);
}

struct ExrReader::Impl {
    std::string path;
    std::unique_ptr<Imf::MultiPartInputFile> file;
    Image header;
    std::vector<int> places;  ///< in the file, of the parts that are not deep
    std::vector<std::string> deep_parts;
    std::vector<Window> windows;
    std::vector<int> chunk_rows;
};

ExrReader::ExrReader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

ExrReader::~ExrReader() = default;
ExrReader::ExrReader(ExrReader&&) noexcept = default;
ExrReader& ExrReader::operator=(ExrReader&&) noexcept = default;

Result<ExrReader> ExrReader::open(const std::string& path, Chunks chunks) {
    start_exr_threads();
    if (auto whole = check_headers(path); !whole) return whole.error();
    const auto error = [&path](const std::string& why) {
        return Error{"io-open", fmt::format("cannot open {}: {}", path, why)};
    };
    auto impl = std::make_unique<Impl>();
    impl->path = path;
    try {
        const int threads = chunks == Chunks::One ? 0 : Imf::globalThreadCount();
        impl->file = std::make_unique<Imf::MultiPartInputFile>(path.c_str(), threads);
        const uint64_t file_bytes = std::filesystem::file_size(path);
        uint64_t min_bytes = 0;  // of all parts up to here
        for (int i = 0; i < impl->file->parts(); ++i) {
            const Imf::Header& header = impl->file->header(i);
            if (header.hasType() && !Imf::isImage(header.type())) {
                impl->deep_parts.push_back(header.hasName() ? header.name() : std::string());
                continue;
            }
            const bool is_first = impl->places.empty();
            const Window data = window_of(header.dataWindow());
            if (data.is_empty() || data.pixel_count() > max_pixels)
                return error("data window too large");
            min_bytes += min_bytes_of(header);
            if (min_bytes > file_bytes)
                return error(fmt::format("{} bytes cannot hold {}×{} pixels of part {}", file_bytes,
                                         data.width(), data.height(), i + 1));
            impl->places.push_back(i);
            impl->windows.push_back(data);
            impl->chunk_rows.push_back(rows_per_chunk_of(header));
            Part part;
            part.name = header.hasName() ? header.name() : std::string();
            part.is_lossy = is_lossy(header.compression());
            if (is_first) {
                impl->header.data = data;
                impl->header.display = window_of(header.displayWindow());
                impl->header.pixel_aspect_ratio = header.pixelAspectRatio();
            }
            read_attributes(header, is_first ? impl->header.attributes : part.attributes);
            for (auto c = header.channels().begin(); c != header.channels().end(); ++c) {
                if (c.channel().xSampling != 1 || c.channel().ySampling != 1) {
                    return error(fmt::format("channel {} is subsampled", c.name()));
                }
                part.channels.push_back(Channel::make(c.name(), channel_type(c.channel().type), 0));
            }
            impl->header.parts.push_back(std::move(part));
        }
        if (impl->places.empty()) return error("it has deep data only, which are not supported");
    } catch (const std::exception& e) {
        throw_if_memory(e);
        return error(e.what());
    }
    return ExrReader(std::move(impl));
}

int ExrReader::part_count() const {
    return int(impl_->header.parts.size());
}

const std::vector<std::string>& ExrReader::deep_parts() const {
    return impl_->deep_parts;
}

const Image& ExrReader::header() const {
    return impl_->header;
}

const Window& ExrReader::data_window(int index) const {
    return impl_->windows[size_t(index)];
}

int ExrReader::rows_per_chunk(int index) const {
    return impl_->chunk_rows[size_t(index)];
}

Result<void> ExrReader::read_rows(int index,
                                  int y0,
                                  int y1,
                                  std::span<const RowTarget> targets) const {
    Window rows = data_window(index);
    rows.y0 = y0;
    rows.y1 = y1;
    try {
        Imf::FrameBuffer buffer;
        for (const RowTarget& t : targets) {
            const size_t size = t.type == ChannelType::Half ? 2 : 4;
            buffer.insert(t.channel, Imf::Slice::Make(pixel_type(t.type), t.values, exr_box(rows),
                                                      size, size * size_t(rows.width())));
        }
        Imf::InputPart input(*impl_->file, impl_->places[size_t(index)]);
        input.setFrameBuffer(buffer);
        input.readPixels(y0, y1 - 1);
        return {};
    } catch (const std::exception& e) {
        throw_if_memory(e);
        return Error{"io-read", fmt::format("cannot read {}: {}", impl_->path, e.what())};
    }
}

Result<Part> ExrReader::read_part(int index) const {
    try {
        Part part = impl_->header.parts[size_t(index)];
        const Window& w = impl_->windows[size_t(index)];
        for (Channel& c : part.channels) c = Channel::make(c.name, c.type(), w.pixel_count());
        Imf::InputPart input(*impl_->file, impl_->places[size_t(index)]);
        input.setFrameBuffer(frame_buffer(part, w));
        input.readPixels(w.y0, w.y1 - 1);
        return part;
    } catch (const std::exception& e) {
        throw_if_memory(e);
        return Error{"io-read", fmt::format("cannot read {}: {}", impl_->path, e.what())};
    }
}

Result<Image> read_exr(const std::string& path) {
    auto reader = ExrReader::open(path);
    if (!reader) return reader.error();
    Image image = reader->header();
    for (int i = 0; i < reader->part_count(); ++i) {
        if (reader->data_window(i) != image.data)
            return Error{"io-read",
                         fmt::format("cannot read {}: parts have different data windows", path)};
        auto part = reader->read_part(i);
        if (!part) return part.error();
        image.parts[size_t(i)] = std::move(*part);
    }
    return image;
}

}  // namespace velatura::image
