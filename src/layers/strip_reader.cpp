// SPDX-License-Identifier: Apache-2.0
#include "layers/strip_reader.h"

#include "base/input_guard.h"
#include "base/tasks.h"
#include "image/digest.h"
#include "image/exr.h"
#include "layers/layer_file.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <mutex>
#include <optional>

namespace velatura::layers {

namespace {

/// Buffers of OpenEXR per chunk: compressed, decompressed, and the compressor's own.
constexpr size_t chunk_copies = 3;

/// Files that are open at the same time in a read(), whatever it asks for; processes may often have
/// no more than 1024.
constexpr size_t max_open_files = 256;

/// A data window may be so many times larger than the pixels that are stored.
constexpr int64_t max_empty_space = 16, max_pixels = int64_t(1) << 30;

size_t value_bytes(image::ChannelType type) {
    return type == image::ChannelType::Half ? 2 : 4;
}

/// Which file a path names, and in what state; all zero where there is none.
struct FileStamp {
    uint64_t device = 0, node = 0, bytes = 0;
    int64_t seconds = 0, nanoseconds = 0;  ///< of the last change

    static FileStamp of(const std::string& path) {
        struct stat s {};

        if (stat(path.c_str(), &s) != 0) return {};
        return {uint64_t(s.st_dev), uint64_t(s.st_ino), uint64_t(s.st_size),
                int64_t(s.st_mtim.tv_sec), int64_t(s.st_mtim.tv_nsec)};
    }

    bool operator==(const FileStamp&) const = default;

    /// Readers that have it open keep a file that another has replaced, but not one that was
    /// written over.
    bool is_same_file(const FileStamp& other) const {
        return device == other.device && node == other.node;
    }
};

Error changed(const std::string& path) {
    return {"io-read", fmt::format("cannot read {}: it has changed since it was opened", path)};
}

/// What a file was when it was opened. No reader stays open: there may be thousands of files.
struct SourceFile {
    struct PartSize {
        int rows_per_chunk = 1;
        size_t pixel_bytes = 0;
    };

    std::string path;
    FileStamp stamp;
    std::vector<PartSize> parts;

    /// Errors: that of ExrReader::open, "io-read" where it is another file by now.
    Result<image::ExrReader> open(image::ExrReader::Chunks chunks) const {
        auto reader = image::ExrReader::open(path, chunks);
        if (FileStamp::of(path) != stamp) return changed(path);
        return reader;
    }

    /// After reading: it may have been written over meanwhile. Errors: "io-read".
    Result<void> check() const {
        const FileStamp now = FileStamp::of(path);
        if (now.is_same_file(stamp) && now != stamp) return changed(path);
        return {};
    }
};

/// Channels that come from one part of one file.
struct PartRequest {
    size_t file = 0;
    int part = 0;
    std::vector<size_t> wanted;  ///< positions in the request
    std::vector<image::RowTarget> targets;
    image::Window window;  ///< of the part
};

/// How a request is read: strips of whole chunks, by so many readers.
struct ReadPlan {
    std::vector<PartRequest> parts;  ///< by file
    std::vector<image::ChannelType> types;
    std::vector<size_t> offsets;  ///< of the channels in a worker's buffer
    size_t buffer_bytes = 0;
    int strip_rows = 1;
    size_t workers = 1;
};

/// The readers of a worker: one for each file, as long as there are not too many of them.
class OpenFiles {
  public:
    OpenFiles(const std::vector<SourceFile>& files, size_t max) : files_(files), max_(max) {}

    Result<image::ExrReader*> reader(size_t file) {
        for (Open& open : open_)
            if (open.file == file) return &open.reader;
        auto reader = files_[file].open(image::ExrReader::Chunks::One);
        if (!reader) return reader.error();
        // The others are asked for again with the next strip, as this one is: any will do
        if (open_.size() == max_) open_.pop_back();
        open_.push_back({file, std::move(*reader)});
        return &open_.back().reader;
    }

  private:
    struct Open {
        size_t file;
        image::ExrReader reader;
    };

    const std::vector<SourceFile>& files_;
    size_t max_;
    std::vector<Open> open_;
};

image::Window united(const image::Window& a, const image::Window& b) {
    return {std::min(a.x0, b.x0), std::min(a.y0, b.y0), std::max(a.x1, b.x1), std::max(a.y1, b.y1)};
}

int64_t area_of(const image::Window& w) {
    return (int64_t(w.x1) - w.x0) * (int64_t(w.y1) - w.y0);
}

/// A channel of a part's window over that of the image.
template <class T>
std::vector<T> placed(const std::vector<T>& values,
                      const image::Window& own,
                      const image::Window& all) {
    std::vector<T> wide(all.pixel_count(), T(0));
    for (int y = own.y0; y < own.y1; ++y)
        std::copy_n(values.begin() + std::ptrdiff_t(own.index(own.x0, y)), own.width(),
                    wide.begin() + std::ptrdiff_t(all.index(own.x0, y)));
    return wide;
}

/// Reads the rows of a strip that a part over another window has, and puts them in their place.
Result<void> read_placed(const image::ExrReader& reader,
                         const PartRequest& request,
                         const std::vector<image::RowTarget>& targets,
                         const image::Window& all,
                         const Strip& strip) {
    const image::Window& own = request.window;
    const auto rows = size_t(strip.y1 - strip.y0), width = size_t(all.width());
    for (const image::RowTarget& t : targets)
        std::memset(t.values, 0, rows * width * value_bytes(t.type));
    const int y0 = std::max(strip.y0, own.y0), y1 = std::min(strip.y1, own.y1);
    if (y0 >= y1) return {};
    std::vector<std::vector<std::byte>> buffers;
    std::vector<image::RowTarget> own_targets = targets;
    for (image::RowTarget& t : own_targets) {
        buffers.emplace_back(size_t(y1 - y0) * size_t(own.width()) * value_bytes(t.type));
        t.values = buffers.back().data();
    }
    if (auto done = reader.read_rows(request.part, y0, y1, own_targets); !done) return done;
    for (size_t i = 0; i < targets.size(); ++i) {
        const size_t bytes = value_bytes(targets[i].type), row = size_t(own.width()) * bytes;
        for (int y = y0; y < y1; ++y) {
            const size_t at = size_t(y - strip.y0) * width + size_t(own.x0 - all.x0);
            std::memcpy(static_cast<std::byte*>(targets[i].values) + at * bytes,
                        buffers[i].data() + size_t(y - y0) * row, row);
        }
    }
    return {};
}

}  // namespace

struct StripReader::Impl {
    struct Source {
        size_t file = 0;
        int part = 0;
        image::Window window;
        size_t input = 0;  ///< of those that were opened together
    };

    std::vector<SourceFile> files;
    image::Image description;
    std::vector<Source> sources;  ///< per part of the description
    std::vector<std::string> foreign_parts, deep_parts;
    size_t input_count = 0;
    image::Window input_window;  ///< of the file that is being added

    /// A file with those beside it for the split layout.
    Result<void> add_input(const std::string& path);
    Result<void> take_header(const std::string& path, const image::Image& header);
    Result<void> add_file(const std::string& path,
                          const std::string& part_name,
                          SplitChannels* channels);
    void unite_windows();
    ReadPlan plan(std::span<const ChannelRef> channels, size_t memory_bytes) const;
    Result<void> read_strip(const ReadPlan& plan,
                            OpenFiles& open_files,
                            std::byte* buffer,
                            Strip& strip) const;
};

Result<void> StripReader::Impl::add_file(const std::string& path,
                                         const std::string& part_name,
                                         SplitChannels* channels) {
    SourceFile file{path, FileStamp::of(path), {}};
    const auto reader = file.open(image::ExrReader::Chunks::One);
    if (!reader) return reader.error();
    const bool is_first = channels == nullptr;
    if (is_first) {
        if (auto taken = take_header(path, reader->header()); !taken) return taken;
        input_window = reader->header().data;
    } else if (reader->header().data != input_window) {
        return Error{"io-read", fmt::format("cannot read {}: its data window differs", path)};
    } else if (auto added = channels->add(path, reader->header()); !added) {
        return added;
    }
    deep_parts.insert(deep_parts.end(), reader->deep_parts().begin(), reader->deep_parts().end());
    for (int p = 0; p < reader->part_count(); ++p) {
        image::Part part = reader->header().parts[size_t(p)];
        if (!is_first) part.name = part_name;
        if (is_first && p == 0 && input_count > 0) part.attributes = reader->header().attributes;
        size_t pixel_bytes = 0;
        for (const image::Channel& c : part.channels) pixel_bytes += value_bytes(c.type());
        file.parts.push_back({reader->rows_per_chunk(p), pixel_bytes});
        description.parts.push_back(std::move(part));
        sources.push_back({files.size(), p, reader->data_window(p), input_count});
    }
    files.push_back(std::move(file));
    return {};
}

/// Of the first file, or what another has to have in common with it.
Result<void> StripReader::Impl::take_header(const std::string& path, const image::Image& header) {
    if (input_count == 0) {
        description = header;
        description.parts.clear();
        return {};
    }
    const image::Window &own = header.display, &first = description.display;
    if (own == first && header.pixel_aspect_ratio == description.pixel_aspect_ratio) return {};
    return Error{"files-differ",
                 fmt::format("{} has {}×{} pixels at {},{} with pixel aspect {}, but the first "
                             "file has {}×{} at {},{} with {}; files of one mix must match",
                             path, own.width(), own.height(), own.x0, own.y0,
                             header.pixel_aspect_ratio, first.width(), first.height(), first.x0,
                             first.y0, description.pixel_aspect_ratio)};
}

Result<void> StripReader::Impl::add_input(const std::string& path) {
    guard_input(path);
    const size_t first_part = description.parts.size();
    if (auto added = add_file(path, "", nullptr); !added) return added;
    const image::Image* header = &description;
    image::Image own;
    if (input_count > 0) {
        if (first_part < description.parts.size())
            own.attributes = description.parts[first_part].attributes;
        header = &own;
    }
    const auto split = split_layers(path, *header);
    if (!split) return split.error();
    image::Image of_input;
    of_input.parts.assign(description.parts.begin() + std::ptrdiff_t(first_part),
                          description.parts.end());
    SplitChannels channels(of_input);
    for (const SplitLayer& s : *split) {
        guard_input(s.path);
        if (auto added = add_file(s.path, s.layer, &channels); !added) return added;
    }
    ++input_count;
    return {};
}

/// Makes room for every part that does not lie far off.
void StripReader::Impl::unite_windows() {
    int64_t stored = area_of(description.data);
    for (size_t p = 0; p < sources.size(); ++p) {
        const image::Window& window = sources[p].window;
        if (window == description.data) continue;
        const image::Window both = united(description.data, window);
        stored = std::max(stored, area_of(window));
        // In 64 bits: the sides of a window may be far apart
        const bool is_near = int64_t(both.x1) - both.x0 <= INT32_MAX / 2 &&
                             int64_t(both.y1) - both.y0 <= INT32_MAX / 2 &&
                             area_of(both) <= std::min(max_empty_space * stored, max_pixels);
        // Exact sums belong to the pixels of the beauty, each to its own
        const auto& channels = description.parts[p].channels;
        const bool has_sums =
            std::any_of(channels.begin(), channels.end(),
                        [](const image::Channel& c) { return image::is_bookkeeping(c.name); });
        if (is_near && !has_sums) {
            description.data = both;
        } else {
            foreign_parts.push_back(description.parts[p].name);
            description.parts[p].channels.clear();
        }
    }
}

ReadPlan StripReader::Impl::plan(std::span<const ChannelRef> channels, size_t memory_bytes) const {
    ReadPlan plan;
    const auto width = size_t(description.data.width());
    for (size_t i = 0; i < channels.size(); ++i) {
        const Source& source = sources[channels[i].part];
        auto at = std::find_if(plan.parts.begin(), plan.parts.end(), [&](const PartRequest& p) {
            return p.file == source.file && p.part == source.part;
        });
        if (at == plan.parts.end())
            at = plan.parts.insert(at, {source.file, source.part, {}, {}, source.window});
        at->wanted.push_back(i);
        const image::Channel& channel =
            description.parts[channels[i].part].channels[channels[i].channel];
        at->targets.push_back({channel.name, channel.type(), nullptr});
        plan.types.push_back(channel.type());
    }
    std::stable_sort(plan.parts.begin(), plan.parts.end(),
                     [](const PartRequest& a, const PartRequest& b) { return a.file < b.file; });
    size_t reader_bytes = 0;
    size_t file_count = 0;
    for (size_t i = 0; i < plan.parts.size(); ++i) {
        const SourceFile::PartSize& size =
            files[plan.parts[i].file].parts[size_t(plan.parts[i].part)];
        plan.strip_rows =
            std::max(plan.strip_rows, std::min(size.rows_per_chunk, description.data.height()));
        reader_bytes += chunk_copies * size_t(size.rows_per_chunk) * width * size.pixel_bytes;
        file_count += size_t(i == 0 || plan.parts[i].file != plan.parts[i - 1].file);
    }
    for (const image::ChannelType type : plan.types) {
        plan.offsets.push_back(plan.buffer_bytes);
        plan.buffer_bytes += size_t(plan.strip_rows) * width * value_bytes(type);
    }
    const size_t strips =
        size_t((description.data.height() + plan.strip_rows - 1) / plan.strip_rows);
    const size_t fitting = memory_bytes / std::max<size_t>(reader_bytes + plan.buffer_bytes, 1);
    plan.workers = std::clamp<size_t>(fitting, 1, std::min(strips, size_t(thread_count())));
    plan.workers =
        std::clamp<size_t>(max_open_files / std::max<size_t>(file_count, 1), 1, plan.workers);
    return plan;
}

Result<void> StripReader::Impl::read_strip(const ReadPlan& plan,
                                           OpenFiles& open_files,
                                           std::byte* buffer,
                                           Strip& strip) const {
    strip.channels.resize(plan.types.size());
    for (size_t i = 0; i < plan.types.size(); ++i)
        strip.channels[i] = {plan.types[i], buffer + plan.offsets[i]};
    for (size_t p = 0; p < plan.parts.size(); ++p) {
        std::vector<image::RowTarget> targets = plan.parts[p].targets;
        for (size_t i = 0; i < targets.size(); ++i)
            targets[i].values = buffer + plan.offsets[plan.parts[p].wanted[i]];
        const auto reader = open_files.reader(plan.parts[p].file);
        if (!reader) return reader.error();
        const auto done =
            plan.parts[p].window == description.data
                ? (*reader)->read_rows(plan.parts[p].part, strip.y0, strip.y1, targets)
                : read_placed(**reader, plan.parts[p], targets, description.data, strip);
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
    if (auto added = impl->add_input(path); !added) return added.error();
    impl->unite_windows();
    return StripReader(std::move(impl));
}

Result<StripReader> StripReader::open_together(std::span<const std::string> paths) {
    auto impl = std::make_unique<Impl>();
    for (const std::string& path : paths)
        if (auto added = impl->add_input(path); !added) return added.error();
    const auto is_ours = [](const auto& attribute) {
        return attribute.first.starts_with("velatura/");
    };
    std::erase_if(impl->description.attributes, is_ours);
    for (image::Part& part : impl->description.parts) std::erase_if(part.attributes, is_ours);
    impl->unite_windows();
    return StripReader(std::move(impl));
}

const image::Image& StripReader::description() const {
    return impl_->description;
}

const std::vector<std::string>& StripReader::foreign_parts() const {
    return impl_->foreign_parts;
}

const std::vector<std::string>& StripReader::deep_parts() const {
    return impl_->deep_parts;
}

size_t StripReader::file_of(size_t part) const {
    return impl_->sources[part].input;
}

Result<void> StripReader::read(std::span<const ChannelRef> channels,
                               const std::function<void(const Strip&)>& body,
                               size_t memory_bytes) const {
    const ReadPlan plan = impl_->plan(channels, memory_bytes);
    const image::Window& window = impl_->description.data;
    std::atomic<int> next = window.y0;
    std::mutex mutex;
    Result<void> outcome;
    parallel_for(plan.workers, [&](size_t) {
        const auto fail = [&](const Error& error) {
            const std::scoped_lock lock(mutex);
            if (outcome) outcome = error;
            next = window.y1;
        };
        OpenFiles open_files(impl_->files, max_open_files / plan.workers);
        const auto buffer = std::make_unique_for_overwrite<std::byte[]>(plan.buffer_bytes);
        Strip strip;
        while ((strip.y0 = next.fetch_add(plan.strip_rows)) < window.y1) {
            strip.y1 = std::min(strip.y0 + plan.strip_rows, window.y1);
            if (auto done = impl_->read_strip(plan, open_files, buffer.get(), strip); !done)
                return fail(done.error());
            body(strip);
        }
    });
    for (const PartRequest& p : plan.parts)
        if (outcome) outcome = impl_->files[p.file].check();
    return outcome;
}

Result<image::Image> StripReader::read_all() const {
    image::Image image = impl_->description;
    std::optional<image::ExrReader> reader;  // of the last part's file
    for (size_t p = 0; p < image.parts.size(); ++p) {
        const auto& source = impl_->sources[p];
        if (p == 0 || source.file != impl_->sources[p - 1].file) {
            auto opened = impl_->files[source.file].open(image::ExrReader::Chunks::Several);
            if (!opened) return opened.error();
            reader = std::move(*opened);
        }
        if (image.parts[p].channels.empty()) continue;
        auto part = reader->read_part(source.part);
        if (!part) return part.error();
        image.parts[p].channels = std::move(part->channels);
        if (source.window == image.data) continue;
        for (image::Channel& c : image.parts[p].channels) {
            std::visit([&](auto& values) { values = placed(values, source.window, image.data); },
                       c.data);
        }
    }
    for (const SourceFile& file : impl_->files)
        if (auto same = file.check(); !same) return same.error();
    return image;
}

void for_each_strip(const image::Image& image,
                    std::span<const ChannelRef> channels,
                    const std::function<void(const Strip&)>& body) {
    constexpr int rows = 16;
    const image::Window& window = image.data;
    const auto width = size_t(window.width());
    parallel_for(size_t((window.height() + rows - 1) / rows), [&](size_t s) {
        Strip strip;
        strip.y0 = window.y0 + int(s) * rows;
        strip.y1 = std::min(strip.y0 + rows, window.y1);
        for (const ChannelRef& place : channels) {
            const image::Channel& c = image.parts[place.part].channels[place.channel];
            const size_t skipped = s * rows * width * value_bytes(c.type());
            strip.channels.push_back(
                {c.type(), static_cast<const std::byte*>(c.bytes()) + skipped});
        }
        body(strip);
    });
}

}  // namespace velatura::layers
