// SPDX-License-Identifier: Apache-2.0
#include "layers/strip_reader.h"

#include "base/atomic_file.h"
#include "base/tasks.h"
#include "image/exr.h"
#include "layers/layer_file.h"
#include "temporary.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <mutex>

namespace velatura::image {
namespace {

/// Two parts, half and float, over a window that does not begin at 0 and ends within a chunk.
Image sample_image() {
    Image image;
    image.data = {-3, 5, 30, 58};
    image.display = {0, 0, 40, 60};
    for (const char* name : {"rgba", "matrix"}) {
        Part part;
        part.name = name;
        for (const char* c : {"a", "b", "c"}) {
            const ChannelType type = *c == 'c' ? ChannelType::Float : ChannelType::Half;
            Channel channel =
                Channel::make(std::string(name) + "." + c, type, image.data.pixel_count());
            auto* bytes = static_cast<unsigned char*>(channel.bytes());
            for (size_t i = 0; i < channel.byte_count(); ++i)
                bytes[i] = static_cast<unsigned char>((i * 131 + size_t(*c)) % 97);
            part.channels.push_back(std::move(channel));
        }
        image.parts.push_back(std::move(part));
    }
    return image;
}

/// Puts strips together and compares them with the channels they came from.
class Puzzle {
  public:
    Puzzle(const Image& image, const std::vector<layers::ChannelRef>& places)
        : image_(image), places_(places), rows_(size_t(image.data.height()), 0) {}

    void add(const layers::Strip& strip) {
        const std::scoped_lock lock(mutex_);
        const auto width = size_t(image_.data.width());
        for (int y = strip.y0; y < strip.y1; ++y) ++rows_[size_t(y - image_.data.y0)];
        for (size_t i = 0; i < places_.size(); ++i) {
            const Channel& c = image_.parts[places_[i].part].channels[places_[i].channel];
            const size_t row_bytes = width * (c.type() == ChannelType::Half ? 2 : 4);
            const auto* from = static_cast<const unsigned char*>(c.bytes());
            is_same_ = is_same_ && strip.channels[i].type == c.type() &&
                       std::memcmp(strip.channels[i].values,
                                   from + size_t(strip.y0 - image_.data.y0) * row_bytes,
                                   row_bytes * size_t(strip.y1 - strip.y0)) == 0;
        }
    }

    bool is_whole() const {
        return is_same_ && std::all_of(rows_.begin(), rows_.end(), [](int n) { return n == 1; });
    }

  private:
    const Image& image_;
    std::vector<layers::ChannelRef> places_;
    std::vector<int> rows_;  ///< how often each row came
    bool is_same_ = true;
    std::mutex mutex_;
};

TEST(StripReader, HandsOutEveryRowOfTheChosenChannelsOnce) {
    const Image image = sample_image();
    const std::string path = temporary("strips.exr");
    ASSERT_TRUE(write_exr(path, image).has_value());
    const auto file = layers::StripReader::open(path);
    ASSERT_TRUE(file.has_value()) << file.error().message;
    EXPECT_EQ(file->description().data, image.data);
    EXPECT_EQ(file->description().parts[1].channels[2].size(), 0u);
    const std::vector<std::vector<layers::ChannelRef>> requests = {
        {{0, 0}}, {{1, 2}, {0, 1}}, {{1, 0}, {1, 1}, {0, 2}, {0, 0}}};
    for (const auto& places : requests) {
        // One byte: a single reader, whatever the machine
        for (const size_t memory : {size_t(1), size_t(1) << 30}) {
            Puzzle puzzle(image, places);
            ASSERT_TRUE(file->read(
                                places, [&](const layers::Strip& s) { puzzle.add(s); }, memory)
                            .has_value());
            EXPECT_TRUE(puzzle.is_whole());
        }
        Puzzle in_memory(image, places);
        layers::for_each_strip(image, places, [&](const layers::Strip& s) { in_memory.add(s); });
        EXPECT_TRUE(in_memory.is_whole());
    }
    const auto all = file->read_all();
    ASSERT_TRUE(all.has_value());
    for (size_t p = 0; p < 2; ++p) {
        for (size_t c = 0; c < 3; ++c)
            EXPECT_EQ(all->parts[p].channels[c].data, image.parts[p].channels[c].data);
    }
}

TEST(StripReader, SaysWhatIsWrongWithDamagedFiles) {
    EXPECT_EQ(layers::StripReader::open(temporary("none.exr")).error().code, "io-open");
    const std::string whole = temporary("whole_strips.exr"), cut = temporary("cut_strips.exr");
    ASSERT_TRUE(write_exr(whole, sample_image()).has_value());
    const auto bytes = read_file(whole);
    // Cut in the pixels: the header is good, the rows are not
    ASSERT_TRUE(write_file_atomically(cut, bytes->substr(0, bytes->size() * 3 / 4)).has_value());
    const auto file = layers::StripReader::open(cut);
    if (file) {
        const std::vector<layers::ChannelRef> places = {{0, 0}, {1, 0}};
        const auto read = file->read(places, [](const layers::Strip&) {});
        ASSERT_FALSE(read.has_value());
        EXPECT_EQ(read.error().code, "io-read");
        EXPECT_NE(read.error().message.find("cut_strips.exr"), std::string::npos);
    }
    // Cut at every place: an error or a good header, never a crash
    for (size_t size = 0; size < bytes->size(); size += 97) {
        ASSERT_TRUE(write_file_atomically(cut, bytes->substr(0, size)).has_value());
        const auto reader = layers::StripReader::open(cut);
        if (!reader) continue;
        EXPECT_FALSE(reader->read_all().has_value()) << size;
    }
}

/// Values of every channel, from `seed` on.
void fill(Image& image, unsigned char seed) {
    for (Part& part : image.parts) {
        for (Channel& c : part.channels) {
            auto* bytes = static_cast<unsigned char*>(c.bytes());
            for (size_t i = 0; i < c.byte_count(); ++i)
                bytes[i] = static_cast<unsigned char>((i + seed) % 61);
        }
    }
}

TEST(StripReader, AFileThatWasReplacedIsAnError) {
    Image image = sample_image();
    const std::string path = temporary("replaced.exr");
    const auto expect_error = [&](const layers::StripReader& file, const char* how) {
        const std::vector<layers::ChannelRef> places = {{0, 0}, {1, 2}};
        const auto read = file.read(places, [](const layers::Strip&) {});
        ASSERT_FALSE(read.has_value()) << how;
        EXPECT_EQ(read.error().code, "io-read");
        EXPECT_NE(read.error().message.find("replaced.exr: it has changed since it was opened"),
                  std::string::npos)
            << read.error().message;
        EXPECT_EQ(file.read_all().error().code, "io-read") << how;
    };
    // By one with the same header, by one with fewer channels, by nothing that can be read
    for (int i = 0; i < 3; ++i) {
        ASSERT_TRUE(layers::write_image_file(path, sample_image()).has_value());
        const auto file = layers::StripReader::open(path);
        ASSERT_TRUE(file.has_value());
        Image other = sample_image();
        fill(other, 5);
        if (i == 1) other.parts.pop_back();
        ASSERT_TRUE(i == 2 ? write_file_atomically(path, "no picture").has_value()
                           : layers::write_image_file(path, other).has_value());
        expect_error(*file, "renamed");
    }
    // Written over while it is read: what came before is no longer to be trusted
    ASSERT_TRUE(write_exr(path, image).has_value());
    const auto file = layers::StripReader::open(path);
    ASSERT_TRUE(file.has_value());
    const std::vector<layers::ChannelRef> places = {{0, 0}};
    std::once_flag once;
    const auto read = file->read(places, [&](const layers::Strip&) {
        std::call_once(once,
                       [&] { std::ofstream(path, std::ios::app | std::ios::binary) << "more"; });
    });
    ASSERT_FALSE(read.has_value());
    EXPECT_EQ(read.error().code, "io-read");
    // Replaced while it is read: the readers keep what they opened
    ASSERT_TRUE(layers::write_image_file(path, image).has_value());
    const auto kept = layers::StripReader::open(path);
    ASSERT_TRUE(kept.has_value());
    Puzzle puzzle(image, places);
    std::once_flag again;
    ASSERT_TRUE(kept->read(
                        places,
                        [&](const layers::Strip& s) {
                            puzzle.add(s);
                            std::call_once(again, [&] {
                                ASSERT_TRUE(layers::write_image_file(path, image).has_value());
                            });
                        },
                        1)
                    .has_value());
    EXPECT_TRUE(puzzle.is_whole());
}

TEST(StripReader, FilesOfASplitSetHaveTheirChannelsToThemselves) {
    const std::string folder = temporary("twice");
    std::filesystem::create_directories(folder);
    const auto write = [&](const std::string& name, const std::vector<std::string>& parts,
                           const std::string& split) {
        Image image;
        image.data = image.display = {0, 0, 3, 2};
        for (const std::string& c : parts)
            image.parts.push_back({c, {Channel::make(c + ".R", ChannelType::Half, 6)}, {}});
        if (!split.empty()) image.attributes["velatura/split"] = split;
        ASSERT_TRUE(write_exr(folder + "/" + name, image).has_value());
    };
    write("a.exr", {"a"}, "");
    write("b.exr", {"b"}, "");
    write("again.exr", {"a"}, "");
    write("two.exr", {"c", "d"}, "");

    const struct {
        const char* split;
        const char* why;
    } cases[] = {
        {R"({"a": "a.exr", "b": "b.exr"})", nullptr},
        {R"({"a": "a.exr", "b": "again.exr"})",
         "again.exr: another file of the layout has channel a.R"},
        {R"({"a": "a.exr", "b": "a.exr"})", "a.exr: another file of the layout has channel a.R"},
        {R"({"a": "main.exr"})", "main.exr: another file of the layout has channel rgba.R"},
        {R"({"a": "two.exr"})", "two.exr: a file of a split layout has one part, this one has 2"},
    };

    for (const auto& c : cases) {
        write("main.exr", {"rgba"}, c.split);
        const auto file = layers::StripReader::open(folder + "/main.exr");
        const auto whole = layers::read_layer_file(folder + "/main.exr");
        ASSERT_EQ(file.has_value(), !c.why) << c.split;
        ASSERT_EQ(whole.has_value(), !c.why) << c.split;
        if (!c.why) continue;
        for (const Error& error : {file.error(), whole.error()}) {
            EXPECT_EQ(error.code, "io-read");
            EXPECT_NE(error.message.find(c.why), std::string::npos) << error.message;
        }
    }
}

size_t open_file_count() {
    const std::filesystem::directory_iterator descriptors("/proc/self/fd");
    return size_t(std::distance(begin(descriptors), end(descriptors)));
}

TEST(StripReader, OpensNoMoreFilesThanAProcessMayHave) {
    // A file beside the first for each layer, or a part
    constexpr size_t layers = 300;
    for (const bool is_split : {true, false}) {
        const std::string folder = temporary(is_split ? "split_files" : "split_parts");
        std::filesystem::create_directories(folder);
        const std::string path = folder + "/all.exr";
        Image image, all;
        image.data = image.display = all.data = all.display = {0, 0, 3, 40};
        std::string list;
        std::vector<layers::ChannelRef> places;
        for (size_t i = 0; i < layers; ++i) {
            Image one = all;
            one.parts = {{fmt::format("l{:03}", i),
                          {Channel::make(fmt::format("l{:03}.R", i), ChannelType::Half, 120)},
                          {}}};
            fill(one, static_cast<unsigned char>(i));
            image.parts.push_back(one.parts[0]);
            places.push_back({i, 0});
            if (!is_split || i == 0) continue;
            list += fmt::format("{}\"l{:03}\": \"l{:03}.exr\"", i == 1 ? "" : ", ", i, i);
            ASSERT_TRUE(write_exr(fmt::format("{}/l{:03}.exr", folder, i), one).has_value());
        }
        Image written = image;
        if (is_split) {
            written.parts.resize(1);
            written.attributes["velatura/split"] = "{" + list + "}";
        }
        ASSERT_TRUE(write_exr(path, written).has_value());
        const size_t before = open_file_count();
        const auto file = layers::StripReader::open(path);
        ASSERT_TRUE(file.has_value()) << file.error().message;
        EXPECT_EQ(open_file_count(), before);
        Puzzle puzzle(image, places);
        std::atomic<size_t> max = 0;
        const auto read = file->read(places, [&](const layers::Strip& strip) {
            puzzle.add(strip);
            const size_t now = open_file_count();
            for (size_t m = max; m < now && !max.compare_exchange_weak(m, now);) {
            }
        });
        ASSERT_TRUE(read.has_value()) << read.error().message;
        EXPECT_TRUE(puzzle.is_whole());
        // Those that list the open ones come on top
        const auto threads = size_t(thread_count());
        EXPECT_LE(max, before + (is_split ? 256 : threads) + 2 * threads);
    }
}

TEST(StripReader, RefusesAHeaderThatTheFileCannotHold) {
    const std::string path = temporary("absurd.exr");
    ASSERT_TRUE(write_exr(path, sample_image()).has_value());
    std::string bytes = *read_file(path);
    // The last four numbers of the attribute: x and y of the lower right corner
    const std::string name("dataWindow\0box2i\0\x10\0\0\0", 21);
    const size_t at = bytes.find(name);
    ASSERT_NE(at, std::string::npos);
    const auto set = [&](size_t index, int32_t value) {
        std::memcpy(bytes.data() + at + name.size() + 4 * index, &value, 4);
    };
    for (const int32_t side : {20000, 30000, 1000000000}) {
        set(2, side);
        set(3, side);
        ASSERT_TRUE(write_file_atomically(path, bytes).has_value());
        const auto file = layers::StripReader::open(path);
        ASSERT_FALSE(file.has_value()) << side;
        EXPECT_EQ(file.error().code, "io-open");
        EXPECT_EQ(read_exr(path).error().code, "io-open");
    }
}

}  // namespace
}  // namespace velatura::image
