// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/asset_image.h"

#include "base/exr_headers.h"
#include "base/package_path.h"
#include "plugins/openimageio/one_line.h"

#include <OpenImageIO/strutil.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>
#include <vector>

namespace velatura::plugins::openimageio {

namespace {

Error not_opened(const std::string& why) {
    return {"image-open", one_line(why.empty() ? "not an image" : why)};
}

/// OpenImageIO's name of the format that starts with these bytes; empty when unknown.
std::string_view format_of(std::string_view bytes) {
    if (bytes.starts_with("\x89PNG")) return "png";
    if (bytes.starts_with("\xff\xd8\xff")) return "jpeg";
    if (bytes.starts_with("\x76\x2f\x31\x01")) return "openexr";
    if (bytes.starts_with("II*") || bytes.starts_with(std::string_view("MM\0*", 4))) return "tiff";
    if (bytes.starts_with("#?RADIANCE") || bytes.starts_with("#?RGBE")) return "hdr";
    return {};
}

/// Before OpenEXR opens a file that is one of its own.
Result<void> check_exr_headers(std::string_view bytes) {
    const std::string fault = exr_header_error(bytes, VELATURA_OPENEXR_VERSION);
    if (!fault.empty()) return not_opened(fault);
    return {};
}

/// By the end of the file's name, or else by what it begins with. No further format is tried: each
/// is a decoder more that may be led astray.
Result<std::unique_ptr<OIIO::ImageInput>> open_file(const std::string& file,
                                                    const OIIO::ImageSpec* configuration) {
    [[maybe_unused]] static const bool is_set = OIIO::attribute("try_all_readers", 0);
    std::array<char, 16> head = {};
    const size_t count = OIIO::Filesystem::read_bytes(file, head.data(), head.size());
    const std::string_view format = format_of({head.data(), std::min(count, head.size())});
    if (format == "openexr") {
        const Result<AssetBytesPtr> bytes = open_asset_bytes(file);
        if (!bytes) return bytes.error();
        if (const Result<void> checked = check_exr_headers((*bytes)->bytes()); !checked)
            return checked.error();
    }
    std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(file, configuration);
    if (input) return input;
    const std::string why = OIIO::geterror();
    if (!format.empty()) input = OIIO::ImageInput::create(std::string(format));
    OIIO::ImageSpec spec;
    if (input && input->open(file, spec, configuration ? *configuration : OIIO::ImageSpec()))
        return input;
    // Errors that nobody asks for are kept until the thread ends
    if (input) input->geterror();
    OIIO::geterror();
    return not_opened(why);
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
    // A pipe would wait for its other end, a device may never end, and names of no file are a
    // image to some formats
    if (parts.size() == 1 && !is_regular)
        return not_opened(fmt::format(
            "\"{}\" {}", name,
            OIIO::Filesystem::exists(name) ? "is not a regular file" : "does not exist"));
    if (is_regular) {
        Result<std::unique_ptr<OIIO::ImageInput>> input = open_file(name, configuration);
        if (!input) return input.error();
        image.input_ = std::move(*input);
        return image;
    }
    const Result<AssetBytesPtr> bytes = open_asset_bytes(name);
    if (!bytes) return bytes.error();
    image.bytes_ = *bytes;
    const std::string_view data = image.bytes_->bytes();
    if (format_of(data) == "openexr")
        if (const Result<void> checked = check_exr_headers(data); !checked) return checked.error();
    image.proxy_ = std::make_unique<OIIO::Filesystem::IOMemReader>(data.data(), data.size());
    // The name within the package tells the format by its extension, else the content does
    const std::string& member = parts.back();
    std::string why = "not an image of a known format";
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
