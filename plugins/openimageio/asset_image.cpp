// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/asset_image.h"

#include "base/package_path.h"

#include <OpenImageIO/strutil.h>
#include <fmt/format.h>

namespace velatura::plugins::openimageio {

std::string one_line(std::string text) {
    while (!text.empty() && (text.back() == '\n' || text.back() == '.')) text.pop_back();
    for (char& c : text) {
        if (c == '\n') c = ' ';
    }
    return text;
}

namespace {

Error not_opened(const std::string& why) {
    return {"image-open", one_line(why.empty() ? "not a picture" : why)};
}

/// OpenImageIO's name of the format that starts with these bytes; empty when unknown.
std::string_view format_of(std::string_view bytes) {
    if (bytes.starts_with("\x89PNG")) return "png";
    if (bytes.starts_with("\xff\xd8\xff")) return "jpeg";
    if (bytes.starts_with("\x76\x2f\x31\x01")) return "openexr";
    if (bytes.starts_with("II*") || bytes.starts_with("MM")) return "tiff";
    if (bytes.starts_with("#?RADIANCE") || bytes.starts_with("#?RGBE")) return "hdr";
    return {};
}

/// Lower case and without the dot.
std::string extension_of(const std::string& name) {
    return OIIO::Strutil::lower(OIIO::Filesystem::extension(name, false));
}

}  // namespace

Result<AssetImage> open_asset_image(const std::string& name, const OIIO::ImageSpec* configuration) {
    AssetImage image;
    const std::vector<std::string> parts = split_package_path(name);
    const bool is_regular = OIIO::Filesystem::is_regular(name);
    // A pipe would wait for its other end, a device may never end, and names of no file are a picture to some formats
    if (parts.size() == 1 && !is_regular)
        return not_opened(fmt::format(
            "\"{}\" {}", name,
            OIIO::Filesystem::exists(name) ? "is not a regular file" : "does not exist"));
    if (is_regular) {
        image.input_ = OIIO::ImageInput::open(name, configuration);
        if (!image.input_) return not_opened(OIIO::geterror());
        return image;
    }
    const Result<AssetBytesPtr> bytes = open_asset_bytes(name);
    if (!bytes) return bytes.error();
    image.bytes_ = *bytes;
    const std::string_view data = image.bytes_->bytes();
    image.proxy_ = std::make_unique<OIIO::Filesystem::IOMemReader>(data.data(), data.size());
    // The name within the package tells the format by its extension, else the content does
    const std::string& member = parts.back();
    std::string why = "not a picture of a known format";
    for (const std::string& format : {extension_of(member), std::string(format_of(data))}) {
        image.input_ = format.empty() ? nullptr : OIIO::ImageInput::create(format);
        OIIO::geterror();
        if (!image.input_) continue;
        if (!image.input_->supports("ioproxy")) {
            why = fmt::format("the format {} cannot be read inside a package",
                              image.input_->format_name());
            continue;
        }
        OIIO::ImageSpec spec;
        image.input_->set_ioproxy(image.proxy_.get());
        if (image.input_->open(member, spec, configuration ? *configuration : OIIO::ImageSpec())) {
            return image;
        }
        why = image.input_->geterror();
        image.proxy_->seek(0);
    }
    return not_opened(why);
}

}  // namespace velatura::plugins::openimageio
