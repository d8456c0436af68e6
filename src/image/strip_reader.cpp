// SPDX-License-Identifier: Apache-2.0
#include "image/strip_reader.h"

#include "base/tasks.h"
#include "image/exr.h"
#include "image/layer_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <mutex>

namespace velatura::image {

namespace {

/// Buffers of OpenEXR per chunk: compressed, decompressed, and the compressor's own.
constexpr size_t chunk_copies = 3;

size_t value_bytes(ChannelType type) {
    return type == ChannelType::Half ? 2 : 4;
}

/// Channels that come from one part of one file.
struct PartRequest {
    size_t file = 0;
    int part = 0;
    std::vector<size_t> wanted;  ///< positions in the request
    std::vector<RowTarget> targets;
};

/// How a request is read: strips of whole chunks, by so many readers.
struct ReadPlan {
    std::vector<PartRequest> parts;
    std::vector<ChannelType> types;
    std::vector<size_t> offsets;  ///< of the channels in a worker's buffer
    size_t buffer_bytes = 0;
    int strip_rows = 1;
    size_t workers = 1;
};

}  // namespace

struct StripReader::Impl {
    struct Source {
        size_t file = 0;
        int part = 0;
    };

    std::vector<std::string> paths;
    std::vector<ExrReader> headers;  ///< one open reader per file, for what its parts are
    Image description;
    std::vector<Source> sources;  ///< per part of the description
    std::vector<std::string> foreign_parts;

    Result<void> add_file(const std::string& path, const std::string& part_name);
    ReadPlan plan(std::span<const ChannelPlace> channels, size_t memory_bytes) const;
    Result<void> read_strip(const ReadPlan& plan,
                            std::vector<ExrReader>& readers,
                            std::byte* buffer,
                            Strip& strip) const;
};

Result<void> StripReader::Impl::add_file(const std::string& path, const std::string& part_name) {
    auto reader = ExrReader::open(path, ExrReader::Chunks::One);
    if (!reader) return reader.error();
    const bool is_first = paths.empty();
    if (is_first) {
        description = reader->header();
        description.parts.clear();
    } else if (reader->header().data != description.data) {
        return Error{"io-read", fmt::format("cannot read {}: its data window differs", path)};
    }
    for (int p = 0; p < reader->part_count(); ++p) {
        Part part = reader->header().parts[size_t(p)];
        if (!is_first) part.name = part_name;
        if (reader->data_window(p) != description.data) {
            foreign_parts.push_back(part.name);
            part.channels.clear();
        }
        description.parts.push_back(std::move(part));
        sources.push_back({paths.size(), p});
    }
    paths.push_back(path);
    headers.push_back(std::move(*reader));
    return {};
}

ReadPlan StripReader::Impl::plan(std::span<const ChannelPlace> channels,
                                 size_t memory_bytes) const {
    ReadPlan plan;
    const auto width = size_t(description.data.width());
    for (size_t i = 0; i < channels.size(); ++i) {
        const Source& source = sources[channels[i].part];
        auto at = std::find_if(plan.parts.begin(), plan.parts.end(), [&](const PartRequest& p) {
            return p.file == source.file && p.part == source.part;
        });
        if (at == plan.parts.end()) at = plan.parts.insert(at, {source.file, source.part, {}, {}});
        at->wanted.push_back(i);
        const Channel& channel = description.parts[channels[i].part].channels[channels[i].channel];
        at->targets.push_back({channel.name, channel.type(), nullptr});
        plan.types.push_back(channel.type());
    }
    size_t reader_bytes = 0;
    for (const PartRequest& p : plan.parts) {
        const ExrReader& header = headers[p.file];
        const int rows = header.rows_per_chunk(p.part);
        plan.strip_rows = std::max(plan.strip_rows, std::min(rows, description.data.height()));
        size_t pixel_bytes = 0;
        for (const Channel& c : header.header().parts[size_t(p.part)].channels)
            pixel_bytes += value_bytes(c.type());
        reader_bytes += chunk_copies * size_t(rows) * width * pixel_bytes;
    }
    for (const ChannelType type : plan.types) {
        plan.offsets.push_back(plan.buffer_bytes);
        plan.buffer_bytes += size_t(plan.strip_rows) * width * value_bytes(type);
    }
    const size_t strips =
        size_t((description.data.height() + plan.strip_rows - 1) / plan.strip_rows);
    const size_t fitting = memory_bytes / std::max<size_t>(reader_bytes + plan.buffer_bytes, 1);
    plan.workers = std::clamp<size_t>(fitting, 1, std::min(strips, size_t(thread_count())));
    return plan;
}

Result<void> StripReader::Impl::read_strip(const ReadPlan& plan,
                                           std::vector<ExrReader>& readers,
                                           std::byte* buffer,
                                           Strip& strip) const {
    strip.channels.resize(plan.types.size());
    for (size_t i = 0; i < plan.types.size(); ++i)
        strip.channels[i] = {plan.types[i], buffer + plan.offsets[i]};
    for (size_t p = 0; p < plan.parts.size(); ++p) {
        std::vector<RowTarget> targets = plan.parts[p].targets;
        for (size_t i = 0; i < targets.size(); ++i)
            targets[i].values = buffer + plan.offsets[plan.parts[p].wanted[i]];
        const auto done = readers[p].read_rows(plan.parts[p].part, strip.y0, strip.y1, targets);
        if (!done) return done;
    }
    return {};
}

StripReader::StripReader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

StripReader::~StripReader() = default;
StripReader::StripReader(StripReader&&) noexcept = default;
StripReader& StripReader::operator=(StripReader&&) noexcept = default;

Result<StripReader> StripReader::open(const std::string& path) {
    auto impl = std::make_unique<Impl>();
    if (auto added = impl->add_file(path, ""); !added) return added.error();
    const auto split = split_layers(path, impl->description);
    if (!split) return split.error();
    for (const SplitLayer& s : *split) {
        if (auto added = impl->add_file(s.path, s.layer); !added) return added.error();
    }
    return StripReader(std::move(impl));
}

const Image& StripReader::description() const {
    return impl_->description;
}

const std::vector<std::string>& StripReader::foreign_parts() const {
    return impl_->foreign_parts;
}

Result<void> StripReader::read(std::span<const ChannelPlace> channels,
                               const std::function<void(const Strip&)>& body,
                               size_t memory_bytes) const {
    const ReadPlan plan = impl_->plan(channels, memory_bytes);
    const Window& window = impl_->description.data;
    std::atomic<int> next = window.y0;
    std::mutex mutex;
    Result<void> outcome;
    parallel_for(plan.workers, [&](size_t) {
        const auto fail = [&](const Error& error) {
            const std::scoped_lock lock(mutex);
            if (outcome) outcome = error;
            next = window.y1;
        };
        std::vector<ExrReader> readers;
        for (const PartRequest& p : plan.parts) {
            auto reader = ExrReader::open(impl_->paths[p.file], ExrReader::Chunks::One);
            if (!reader) return fail(reader.error());
            readers.push_back(std::move(*reader));
        }
        const auto buffer = std::make_unique_for_overwrite<std::byte[]>(plan.buffer_bytes);
        Strip strip;
        while ((strip.y0 = next.fetch_add(plan.strip_rows)) < window.y1) {
            strip.y1 = std::min(strip.y0 + plan.strip_rows, window.y1);
            if (auto done = impl_->read_strip(plan, readers, buffer.get(), strip); !done)
                return fail(done.error());
            body(strip);
        }
    });
    return outcome;
}

Result<Channel> StripReader::read_channel(ChannelPlace place) const {
    const Window& window = impl_->description.data;
    const Channel& described = impl_->description.parts[place.part].channels[place.channel];
    Channel channel = Channel::make(described.name, described.type(), window.pixel_count());
    const size_t row_bytes = size_t(window.width()) * value_bytes(channel.type());
    auto* to = static_cast<std::byte*>(channel.bytes());
    const auto done = read({&place, 1}, [&](const Strip& strip) {
        std::memcpy(to + size_t(strip.y0 - window.y0) * row_bytes, strip.channels[0].values,
                    size_t(strip.y1 - strip.y0) * row_bytes);
    });
    if (!done) return done.error();
    return channel;
}

Result<Image> StripReader::read_all() const {
    Image image = impl_->description;
    for (size_t p = 0; p < image.parts.size(); ++p) {
        if (image.parts[p].channels.empty()) continue;
        const auto& source = impl_->sources[p];
        auto reader = ExrReader::open(impl_->paths[source.file]);
        if (!reader) return reader.error();
        auto part = reader->read_part(source.part);
        if (!part) return part.error();
        image.parts[p].channels = std::move(part->channels);
    }
    return image;
}

void for_each_strip(const Image& image,
                    std::span<const ChannelPlace> channels,
                    const std::function<void(const Strip&)>& body) {
    constexpr int rows = 16;
    const Window& window = image.data;
    const auto width = size_t(window.width());
    parallel_for(size_t((window.height() + rows - 1) / rows), [&](size_t s) {
        Strip strip;
        strip.y0 = window.y0 + int(s) * rows;
        strip.y1 = std::min(strip.y0 + rows, window.y1);
        for (const ChannelPlace& place : channels) {
            const Channel& c = image.parts[place.part].channels[place.channel];
            const size_t skipped = s * rows * width * value_bytes(c.type());
            strip.channels.push_back(
                {c.type(), static_cast<const std::byte*>(c.bytes()) + skipped});
        }
        body(strip);
    });
}

}  // namespace velatura::image
