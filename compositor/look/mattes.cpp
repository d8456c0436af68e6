// SPDX-License-Identifier: Apache-2.0
#include "compositor/look/mattes.h"

#include "base/nearest_names.h"
#include "compositor/io/row_values.h"
#include "compositor/look/controls.h"
#include "layers/cryptomatte.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <span>

namespace velatura::compositor {
inline namespace look {

namespace {

/// `!LAYER:PATTERN` in pieces.
struct Request {
    bool is_inverted = false;
    std::string source, choice;
    bool is_image = false;
};

Result<Request> parse_request(std::span<const layers::Cryptomatte> mattes,
                              const std::string& text) {
    Request request;
    request.is_inverted = text.starts_with('!');
    const std::string rest = text.substr(request.is_inverted ? 1 : 0);
    // A layer of the file as it stands, whatever its name and those of its objects hold
    for (const layers::Cryptomatte& matte : mattes) {
        if (!rest.starts_with(matte.layer + ":") || rest.size() == matte.layer.size() + 1) continue;
        request.source = matte.layer;
        request.choice = rest.substr(matte.layer.size() + 1);
        return request;
    }
    // A path may hold a colon itself, a prim path never ends in .exr
    const size_t image = rest.rfind(".exr:");
    request.is_image = image != std::string::npos;
    const size_t colon = request.is_image ? image + 4 : rest.find(':');
    if (colon == 0 || colon == std::string::npos || colon + 1 == rest.size()) {
        return Error{
            "bad-matte",
            fmt::format("'{}' is not a matte; expected CryptoObject:PATTERN or FILE.exr:CHANNEL",
                        text)};
    }
    request.source = rest.substr(0, colon);
    request.choice = rest.substr(colon + 1);
    return request;
}

/// `CryptoObject00.R` belongs to `CryptoObject`.
bool is_level_of(const std::string& channel, const std::string& layer) {
    return channel.size() > layer.size() && channel.starts_with(layer) &&
           channel[layer.size()] >= '0' && channel[layer.size()] <= '9';
}

std::vector<layers::ChannelRef> level_channels(const image::Image& image,
                                               const std::string& layer) {
    std::vector<layers::ChannelRef> places;
    for (size_t p = 0; p < image.parts.size(); ++p) {
        for (size_t c = 0; c < image.parts[p].channels.size(); ++c) {
            const image::Channel& channel = image.parts[p].channels[c];
            if (is_level_of(channel.name, layer) && channel.type() == image::ChannelType::Float)
                places.push_back({p, c});
        }
    }
    return places;
}

/// A strip as an image of its own.
image::Image strip_image(const image::Image& of,
                         const std::vector<layers::ChannelRef>& places,
                         const layers::Strip& strip) {
    image::Image image;
    image.data = of.data;
    image.data.y0 = strip.y0;
    image.data.y1 = strip.y1;
    image.parts.resize(1);
    for (size_t i = 0; i < places.size(); ++i) {
        const std::string& name = of.parts[places[i].part].channels[places[i].channel].name;
        auto channel =
            image::Channel::make(name, image::ChannelType::Float, image.data.pixel_count());
        std::memcpy(channel.bytes(), strip.channels[i].values, channel.byte_count());
        image.parts[0].channels.push_back(std::move(channel));
    }
    return image;
}

/// A name as it stands, or several patterns.
std::vector<std::string> patterns_of(const layers::Cryptomatte& matte, const std::string& choice) {
    const bool is_name = std::any_of(matte.names.begin(), matte.names.end(),
                                     [&](const layers::MatteName& n) { return n.name == choice; });
    return is_name ? std::vector<std::string>{choice} : split_at_commas(choice);
}

Result<std::vector<float>> cut_cryptomatte(const LayerStack& stack,
                                           const layers::StripReader* file,
                                           std::span<const layers::Cryptomatte> mattes,
                                           const Request& request,
                                           size_t strip_bytes,
                                           std::vector<std::string>& notes) {
    const image::Image& image = stack.image();
    const auto found = layers::find_matte(mattes, request.source);
    if (!found) return found.error();
    const layers::Cryptomatte& matte = **found;
    if (!matte.fault.empty())
        notes.push_back(
            fmt::format("the manifest of {}: {}{}", matte.layer, matte.fault,
                        matte.names.empty() ? "; names are matched by their hash" : ""));
    const auto ids = layers::matte_ids(matte, patterns_of(matte, request.choice));
    if (!ids) return ids.error();
    const auto places = level_channels(image, matte.layer);
    if (places.empty()) return layers::no_ids(image, matte.layer);
    if (image.parts[places[0].part].is_lossy)
        notes.push_back(fmt::format(
            "{} is stored with lossy compression, which changes ids: mattes of it have holes",
            matte.layer));

    std::vector<float> values(image.data.pixel_count());
    const auto cut = [&](const layers::Strip& strip) {
        const auto part =
            layers::matte_coverage(strip_image(image, places, strip), matte.layer, *ids);
        if (!part) return;
        std::copy(part->begin(), part->end(),
                  values.begin() + std::ptrdiff_t(image.data.index(image.data.x0, strip.y0)));
    };
    if (file) {
        if (auto done = file->read(places, cut, strip_bytes); !done) return done.error();
    } else {
        layers::for_each_strip(image, places, cut);
    }
    if (std::all_of(values.begin(), values.end(), [](float v) { return v == 0.0f; }))
        notes.push_back(fmt::format("no pixel of {} shows \"{}\": the matte is empty", matte.layer,
                                    request.choice));
    return values;
}

Result<std::vector<float>> read_image(const LayerStack& stack,
                                      const Request& request,
                                      size_t strip_bytes) {
    const auto file = layers::StripReader::open(request.source);
    if (!file) return file.error();
    const image::Image& image = file->description();
    std::vector<std::string> names;
    std::vector<layers::ChannelRef> places;
    for (size_t p = 0; p < image.parts.size(); ++p) {
        for (size_t c = 0; c < image.parts[p].channels.size(); ++c) {
            names.push_back(image.parts[p].channels[c].name);
            places.push_back({p, c});
        }
    }
    const auto at = std::find(names.begin(), names.end(), request.choice);
    if (at == names.end()) {
        return Error{"matte-channel",
                     fmt::format("{} has no channel '{}'{}", request.source, request.choice,
                                 did_you_mean(request.choice, names))};
    }
    const image::Window &a = image.data, &b = stack.image().data;
    if (a != b) {
        return Error{
            "matte-window",
            fmt::format("the matte {} has {}×{} pixels at {},{}, the layers {}×{} at {},{}",
                        request.source, a.width(), a.height(), a.x0, a.y0, b.width(), b.height(),
                        b.x0, b.y0)};
    }
    std::vector<float> values(b.pixel_count());
    const auto take = [&](const layers::Strip& strip) {
        load_row(strip.channels[0], 0, size_t(strip.y1 - strip.y0) * size_t(b.width()),
                 values.data() + b.index(b.x0, strip.y0));
    };
    const auto done = file->read({&places[size_t(at - names.begin())], 1}, take, strip_bytes);
    if (!done) return done.error();
    return values;
}

}  // namespace

Result<Matte> load_matte(const LayerStack& stack,
                         const layers::StripReader* file,
                         const std::string& text,
                         size_t strip_bytes) {
    const std::vector<layers::Cryptomatte> mattes =
        layers::cryptomattes_of(stack.image(), stack.path());
    const auto request = parse_request(mattes, text);
    if (!request) return request.error();
    std::vector<std::string> notes;
    auto values = request->is_image
                      ? read_image(stack, *request, strip_bytes)
                      : cut_cryptomatte(stack, file, mattes, *request, strip_bytes, notes);
    if (!values) return values.error();
    for (float& v : *values) {
        v = std::clamp(v, 0.0f, 1.0f);
        if (request->is_inverted) v = 1.0f - v;
    }
    return Matte{text, std::make_shared<const std::vector<float>>(std::move(*values)),
                 std::move(notes)};
}

Result<std::optional<MatteIds>> matte_ids_of(const LayerStack& stack, const std::string& text) {
    const std::vector<layers::Cryptomatte> mattes =
        layers::cryptomattes_of(stack.image(), stack.path());
    const auto request = parse_request(mattes, text);
    if (!request) return request.error();
    if (request->is_image) return std::optional<MatteIds>();
    const auto found = layers::find_matte(mattes, request->source);
    if (!found) return found.error();
    auto ids = layers::matte_ids(**found, patterns_of(**found, request->choice));
    if (!ids) return ids.error();
    return std::optional(MatteIds{request->is_inverted, **found, std::move(*ids)});
}

}  // namespace look
}  // namespace velatura::compositor
