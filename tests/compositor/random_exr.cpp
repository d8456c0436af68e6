// SPDX-License-Identifier: Apache-2.0
#include "compositor/random_exr.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfChromaticitiesAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfRationalAttribute.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfStringVectorAttribute.h>
#include <OpenEXR/ImfTileDescription.h>
#include <OpenEXR/ImfTiledOutputPart.h>
#include <OpenEXR/ImfTimeCodeAttribute.h>
#include <OpenEXR/ImfVecAttribute.h>
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <random>
#include <set>

namespace velatura::compositor {

namespace {

using Random = std::mt19937_64;

/// In [0, count), the same with every library.
size_t pick(Random& random, size_t count) {
    return size_t(random() % count);
}

bool happens(Random& random, size_t one_in) {
    return pick(random, one_in) == 0;
}

/// Printable ASCII, sometimes UTF-8 or bytes that are none.
std::string random_name(Random& random) {
    std::string name;
    const size_t length = 1 + pick(random, happens(random, 8) ? 60 : 12);
    for (size_t i = 0; i < length; ++i) name += char(' ' + pick(random, 95));
    if (happens(random, 12)) name += "\xc3\xa4";
    if (happens(random, 30)) name += "\xff\x80";
    // Names that words of the grammar, or of other programs, collide with
    constexpr std::array words = {"key",
                                  "all",
                                  "shadow",
                                  "rest",
                                  "b1",
                                  "env",
                                  "ViewLayer.DiffDir",
                                  "RGBA_char:key",
                                  "lpe:C[<L.'key'>]",
                                  "a=b",
                                  "N",
                                  "AO",
                                  "1"};
    if (happens(random, 4)) name = words[pick(random, words.size())];
    // No beauty by chance
    std::string last = name.substr(name.rfind('.') + 1);
    std::erase_if(last, [](char c) { return c == ' ' || c == '_'; });
    if (last == "c" || last == "C" ||
        (last.size() == 2 && (last[0] | 32) == 'c' && (last[1] | 32) == 'i'))
        name += 'q';
    return name;
}

float random_value(Random& random) {
    switch (pick(random, 40)) {
        case 0:
            return std::numeric_limits<float>::quiet_NaN();
        case 1:
            return std::numeric_limits<float>::infinity();
        case 2:
            return -std::numeric_limits<float>::infinity();
        case 3:
            return 0.0f;
        case 4:
            return -0.5f;
        case 5:
            return 65000.0f;
        default:
            return float(pick(random, 1 << 16)) / 4096.0f;
    }
}

RandomExr::Channel random_channel(Random& random,
                                  const std::string& name,
                                  image::ChannelType type,
                                  size_t pixels) {
    RandomExr::Channel channel{name, type, std::vector<float>(pixels)};
    const bool is_clean = !happens(random, 4);
    for (float& v : channel.values) {
        v = random_value(random);
        if (is_clean && !(v > 0 && v < 1e9f)) v = 0.25f;
        if (type == image::ChannelType::Half) v = float(Imath::half(v));
        if (type == image::ChannelType::Uint) v = float(pick(random, 1 << 20));
    }
    return channel;
}

image::ChannelType random_type(Random& random) {
    const size_t one = pick(random, 12);
    return one == 0  ? image::ChannelType::Uint
           : one < 6 ? image::ChannelType::Half
                     : image::ChannelType::Float;
}

image::Window random_window(Random& random, const image::Window& display) {
    if (happens(random, 2)) return display;
    const int x = display.x0 + int(pick(random, 9)) - 4, y = display.y0 + int(pick(random, 9)) - 4;
    return {x, y, x + 1 + int(pick(random, size_t(display.width()) + 8)),
            y + 1 + int(pick(random, size_t(display.height()) + 8))};
}

/// A layer of colors or of data.
void add_layer(Random& random,
               RandomExr::Part& part,
               const std::string& layer,
               bool is_light,
               std::set<std::string>& taken) {
    static const std::vector<std::vector<const char*>> suffixes = {{"R", "G", "B"},
                                                                   {"R", "G", "B", "A"},
                                                                   {"red", "green", "blue"},
                                                                   {"r", "g", "b", "a"},
                                                                   {"X", "Y", "Z"},
                                                                   {"Z"},
                                                                   {"U", "V"},
                                                                   {"x"}};
    const size_t choice = pick(random, is_light ? 4 : suffixes.size());
    // The light that a file without a beauty has at least
    const image::ChannelType type = layer == "light" || (is_light && happens(random, 2))
                                        ? image::ChannelType::Float
                                        : random_type(random);
    std::vector<std::string> names;
    for (const char* suffix : suffixes[choice])
        names.push_back(layer.empty() ? std::string(suffix) : layer + "." + suffix);
    if (std::any_of(names.begin(), names.end(),
                    [&](const std::string& n) { return taken.count(n) != 0; }))
        return;
    for (const std::string& name : names) {
        taken.insert(name);
        part.channels.push_back(random_channel(random, name, type, part.data.pixel_count()));
    }
    part.layers.push_back(layer);
}

void add_metadata(Random& random, Imf::Header& header, bool is_first) {
    if (happens(random, 3))
        header.insert("comments", Imf::StringAttribute(random_name(random) + "\n\"\\"));
    if (happens(random, 6)) header.insert("owner", Imf::StringAttribute(""));
    if (happens(random, 8)) header.insert(random_name(random).c_str(), Imf::IntAttribute(-1));
    if (happens(random, 8)) header.insert("v", Imf::V3fAttribute(Imath::V3f(1, 2, 3)));
    if (!is_first) return;
    if (happens(random, 6))
        header.insert("cryptomatte/abc1234/name", Imf::StringAttribute(random_name(random)));
    if (happens(random, 8))
        header.insert("cryptomatte/abc1234/manifest", Imf::StringAttribute("{\"a\": \"zz"));
    if (happens(random, 6))
        header.insert("colorInteropID", Imf::StringAttribute(random_name(random)));
    if (happens(random, 10)) header.insert("colorInteropID", Imf::StringAttribute("data"));
    if (happens(random, 8))
        header.insert("framesPerSecond", Imf::RationalAttribute(Imf::Rational(24000, 1001)));
    if (happens(random, 10)) header.insert("software", Imf::IntAttribute(3));
    if (happens(random, 12)) header.insert("velatura/scene", Imf::StringAttribute("[1,"));
    if (happens(random, 12)) header.insert("multiView", Imf::StringVectorAttribute({"left"}));
    if (happens(random, 10)) header.insert("view", Imf::StringAttribute("left"));
    if (happens(random, 10))
        header.insert("worldToCamera", Imf::M44fAttribute(Imath::M44f(std::nanf(""))));
}

/// OpenEXR wants these to be the same on every part.
void add_shared_metadata(Random& random, Imf::Header& header) {
    const auto some = [&] { return float(pick(random, 100)) / 100.0f; };
    if (happens(random, 8))
        header.insert("chromaticities",
                      Imf::ChromaticitiesAttribute(Imf::Chromaticities(
                          {some(), some()}, {some(), some()}, {some(), some()}, {some(), some()})));
    if (happens(random, 10))
        header.insert("timeCode", Imf::TimeCodeAttribute(Imf::TimeCode(1, 2, 3, 4)));
}

Imf::PixelType pixel_type(image::ChannelType type) {
    return type == image::ChannelType::Half   ? Imf::HALF
           : type == image::ChannelType::Uint ? Imf::UINT
                                              : Imf::FLOAT;
}

/// What OpenEXR writes from: 4 bytes for every value.
class Pixels {
  public:
    explicit Pixels(const RandomExr::Part& part) {
        const auto width = size_t(part.data.width());
        for (const RandomExr::Channel& c : part.channels) {
            auto& words = words_.emplace_back(c.values.size());
            for (size_t i = 0; i < words.size(); ++i) {
                const float v = c.values[i];
                words[i] = c.type == image::ChannelType::Half    ? Imath::half(v).bits()
                           : c.type == image::ChannelType::Float ? std::bit_cast<uint32_t>(v)
                                                                 : uint32_t(v);
            }
            buffer.insert(c.name,
                          Imf::Slice::Make(pixel_type(c.type), words.data(),
                                           Imath::Box2i({part.data.x0, part.data.y0},
                                                        {part.data.x1 - 1, part.data.y1 - 1}),
                                           4, 4 * width));
        }
    }

    Imf::FrameBuffer buffer;

  private:
    std::vector<std::vector<uint32_t>> words_;
};

void write(Random& random, const RandomExr& file, const std::string& path) {
    constexpr std::array compressions = {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION,
                                         Imf::ZIPS_COMPRESSION, Imf::ZIP_COMPRESSION,
                                         Imf::PIZ_COMPRESSION};
    const auto box = [](const image::Window& w) {
        return Imath::Box2i({w.x0, w.y0}, {w.x1 - 1, w.y1 - 1});
    };
    Imf::Header shared;
    add_shared_metadata(random, shared);
    std::vector<Imf::Header> headers;
    for (const RandomExr::Part& part : file.parts) {
        Imf::Header header(box(file.display), box(part.data), file.pixel_aspect);
        header.compression() = compressions[pick(random, compressions.size())];
        add_metadata(random, header, headers.empty());
        for (const char* name : {"chromaticities", "timeCode"}) {
            if (const auto at = shared.find(name); at != shared.end())
                header.insert(name, at.attribute());
        }
        for (const RandomExr::Channel& c : part.channels)
            header.channels().insert(c.name, Imf::Channel(pixel_type(c.type)));
        const bool is_tiled = happens(random, 3);
        if (is_tiled) {
            const bool has_mips = happens(random, 4);
            header.setTileDescription(
                Imf::TileDescription(unsigned(1 + pick(random, 40)), unsigned(1 + pick(random, 40)),
                                     has_mips ? Imf::MIPMAP_LEVELS : Imf::ONE_LEVEL));
        }
        header.lineOrder() = happens(random, 3) ? Imf::DECREASING_Y : Imf::INCREASING_Y;
        header.setName(part.name);
        header.setType(is_tiled ? Imf::TILEDIMAGE : Imf::SCANLINEIMAGE);
        headers.push_back(header);
    }
    Imf::MultiPartOutputFile out(path.c_str(), headers.data(), int(headers.size()));
    for (size_t p = 0; p < file.parts.size(); ++p) {
        const Pixels pixels(file.parts[p]);
        if (headers[p].type() == Imf::SCANLINEIMAGE) {
            Imf::OutputPart part(out, int(p));
            part.setFrameBuffer(pixels.buffer);
            part.writePixels(file.parts[p].data.height());
            continue;
        }
        Imf::TiledOutputPart part(out, int(p));
        part.setFrameBuffer(pixels.buffer);
        // The pixels of smaller levels are the corner of those of the first
        for (int level = 0; level < part.numLevels(); ++level)
            part.writeTiles(0, part.numXTiles(level) - 1, 0, part.numYTiles(level) - 1, level);
    }
}

}  // namespace

const RandomExr::Channel* RandomExr::beauty_channel(size_t c) const {
    constexpr std::array<std::array<const char*, 3>, 3> suffixes = {
        {{"R", "red", "r"}, {"G", "green", "g"}, {"B", "blue", "b"}}};
    for (const char* suffix : suffixes[c]) {
        const std::string name = beauty_layer.empty() ? suffix : beauty_layer + "." + suffix;
        for (const Channel& channel : parts[0].channels)
            if (channel.name == name) return &channel;
    }
    return nullptr;
}

RandomExr write_random_exr(uint64_t seed, const std::string& path) {
    Random random(seed);
    RandomExr file;
    const size_t kind = pick(random, 8);
    file.beauty = kind == 0   ? RandomExr::Beauty::NoLight
                  : kind == 1 ? RandomExr::Beauty::None
                  : kind == 2 ? RandomExr::Beauty::Named
                              : RandomExr::Beauty::Bare;
    const bool is_dot = happens(random, 8);
    const int width = is_dot ? 1 : 1 + int(pick(random, 40)),
              height = is_dot ? 1 : 1 + int(pick(random, 30));
    const int x = happens(random, 3) ? int(pick(random, 200)) - 100 : 0;
    file.display = {x, -x / 2, x + width, height - x / 2};
    constexpr std::array aspects = {1.0f, 1.0f, 2.0f, 0.5f, 1.3333f, 16.0f};
    file.pixel_aspect = aspects[pick(random, aspects.size())];
    const size_t parts = happens(random, 2) ? 1 : 1 + pick(random, 5);
    std::set<std::string> part_names;
    for (size_t p = 0; p < parts; ++p) {
        RandomExr::Part& part = file.parts.emplace_back();
        do {
            part.name = p == 0 ? (happens(random, 2) ? "rgba" : "beauty") : random_name(random);
        } while (!part_names.insert(part.name).second);
        part.data = random_window(random, file.display);
        if (p > 0 && happens(random, 10)) {
            part.is_far = true;
            part.data = {part.data.x0 + 100000, part.data.y0, part.data.x1 + 100000, part.data.y1};
        }
        std::set<std::string> taken;
        const bool is_bright = file.beauty != RandomExr::Beauty::NoLight;
        if (p == 0 && file.beauty == RandomExr::Beauty::Bare)
            add_layer(random, part, "", true, taken);
        if (p == 0 && file.beauty == RandomExr::Beauty::Named) {
            constexpr std::array names = {"ViewLayer.Combined", "rgba", "beauty", "Ci", "RGBA"};
            file.beauty_layer = names[pick(random, names.size())];
            add_layer(random, part, file.beauty_layer, true, taken);
        }
        // A layer by the name of its part
        const bool has_beauty = is_bright && file.beauty != RandomExr::Beauty::None;
        if (p > 0 && has_beauty && happens(random, 3)) add_layer(random, part, "", true, taken);
        const size_t rows = happens(random, 25) ? 300 + pick(random, 101) : pick(random, 7);
        for (size_t i = 0; i < rows; ++i) {
            std::string name = random_name(random);
            if (rows > 100) name += fmt::format("_{}", i);
            const bool is_light = is_bright && !happens(random, 4);
            if (is_light) {
                add_layer(random, part, name, true, taken);
            } else {
                // No R, G, B: X of a vector, Z of a depth
                const std::string channel = name + (happens(random, 2) ? ".Z" : ".id");
                if (!taken.insert(channel).second) continue;
                part.channels.push_back(
                    random_channel(random, channel, random_type(random), part.data.pixel_count()));
                part.layers.push_back(name);
            }
        }
        if (p == 0 && file.beauty == RandomExr::Beauty::None)
            add_layer(random, part, "light", true, taken);
        if (part.channels.empty()) {
            part.channels.push_back(
                random_channel(random, "Z", image::ChannelType::Float, part.data.pixel_count()));
            part.layers.emplace_back("Z");
        }
    }
    std::string names;
    for (const RandomExr::Part& p : file.parts)
        names += fmt::format(" [{} {}×{} {} channels]", p.name, p.data.width(), p.data.height(),
                             p.channels.size());
    file.what = fmt::format("seed {} kind {}{}", seed, int(file.beauty), names);
    write(random, file, path);
    return file;
}

}  // namespace velatura::compositor
