// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/textures.h"

#include "plugins/openimageio/decoding.h"
#include "plugins/openimageio/one_line.h"
#include "plugins/openimageio/texture_input.h"

#include <OpenImageIO/imagecache.h>
#include <OpenImageIO/texture.h>

#include <exception>
#include <new>
#include <unordered_map>

namespace velatura::plugins::openimageio {

namespace {

using OIIO::TextureOpt;
using Handle = OIIO::TextureSystem::TextureHandle*;

/// What a file says of itself.
struct FileFacts {
    bool is_srgb = false;
    size_t bytes = 0;            // as the cache would hold all of it
    std::string wrap_modes;      // OpenImageIO's "wrapmodes", e.g. "periodic,clamp"
    std::string wrap_s, wrap_t;  // the specification's own metadata: black, clamp, repeat, mirror
};

bool is_srgb(const SourceSpec& spec, scene::SourceColorSpace space) {
    if (space != scene::SourceColorSpace::Auto) return space == scene::SourceColorSpace::Srgb;
    // Readers report "sRGB" for every file that says nothing: only the opposite is information
    const std::string& said = spec.color_space;
    if (OIIO::Strutil::iequals(said, "linear") || OIIO::Strutil::iequals(said, "scene_linear")) {
        return false;
    }
    const LevelSpec& level = spec.levels.at(0);
    return level.stored == StoredAs::UInt8 && (level.channels == 3 || level.channels == 4);
}

/// The finest level, and a third of it for those that are made of it.
size_t cached_bytes(const LevelSpec& level, bool is_srgb) {
    const size_t texel = 4 * TextureInput::cached_format(level.stored, is_srgb).size();
    return size_t(level.width) * size_t(level.height) * texel / 3 * 4;
}

Result<FileFacts> examine(ImageSource& images,
                          const std::string& path,
                          scene::SourceColorSpace space,
                          int max_side) {
    const Result<std::unique_ptr<SourceImage>> opened = images.open(path, ImageUse::Texture);
    if (!opened) return Error{"image-open", one_line(opened.error().message)};
    const SourceSpec& spec = (*opened)->spec();
    if (const Result<void> checked = check_texture(spec, max_side); !checked)
        return checked.error();
    const bool decodes = is_srgb(spec, space);
    return FileFacts{decodes, cached_bytes(spec.levels.at(0), decodes), spec.wrap_modes,
                     spec.wrap_s, spec.wrap_t};
}

/// OpenImageIO calls repeating "periodic"; WrapDefault for what is no wrap mode.
TextureOpt::Wrap named_wrap(const std::string& name) {
    if (name == "repeat") return TextureOpt::WrapPeriodic;
    return TextureOpt::decode_wrapmode(name.c_str());
}

TextureOpt::Wrap wrap_mode(scene::Wrap wrap, const FileFacts& facts, bool is_t) {
    switch (wrap) {
        case scene::Wrap::Black:
            return TextureOpt::WrapBlack;
        case scene::Wrap::Clamp:
            return TextureOpt::WrapClamp;
        case scene::Wrap::Repeat:
            return TextureOpt::WrapPeriodic;
        case scene::Wrap::Mirror:
            return TextureOpt::WrapMirror;
        case scene::Wrap::UseMetadata:
            break;
    }
    const TextureOpt::Wrap named = named_wrap(is_t ? facts.wrap_t : facts.wrap_s);
    if (named != TextureOpt::WrapDefault) return named;
    // Without metadata in the file, black
    const std::string& metadata = facts.wrap_modes;
    if (metadata.empty()) return TextureOpt::WrapBlack;
    TextureOpt::Wrap s = TextureOpt::WrapBlack, t = TextureOpt::WrapBlack;
    TextureOpt::parse_wrapmodes(metadata.c_str(), s, t);
    const TextureOpt::Wrap found = is_t ? t : s;
    return found == TextureOpt::WrapDefault ? TextureOpt::WrapBlack : found;
}

class SystemFile final : public shading::TextureFile {
  public:
    SystemFile(OIIO::TextureSystem& system,
               Handle handle,
               TextureOpt::Wrap wrap_s,
               TextureOpt::Wrap wrap_t)
        : system_(system), handle_(handle), wrap_s_(wrap_s), wrap_t_(wrap_t) {}

    bool lookup(const Vec2& st, const Vec2& width, shading::TexelRgba& texel) const override {
        TextureOpt options;
        options.swrap = wrap_s_;
        options.twrap = wrap_t_;
        options.interpmode = TextureOpt::InterpBilinear;
        options.mipmode = TextureOpt::MipModeTrilinear;
        try {
            // USD's origin is the lower left corner, OpenImageIO's the upper left
            return system_.texture(handle_, nullptr, options, st.x, 1.0f - st.y, width.x, 0.0f,
                                   0.0f, width.y, 4, texel.data());
        } catch (const std::exception& e) {
            system_.geterror();
            thrown() = e.what();
            return false;
        }
    }

    /// What the last lookup of this thread ended with, when it was an exception.
    static std::string& thrown() {
        thread_local std::string text;
        return text;
    }

  private:
    OIIO::TextureSystem& system_;
    Handle handle_;
    TextureOpt::Wrap wrap_s_, wrap_t_;
};

class SystemSource final : public shading::TextureSource {
  public:
    SystemSource(ImageSource& images, size_t memory_bytes)
        : sources_(images),
          images_(OIIO::ImageCache::create(false)),
          system_(OIIO::TextureSystem::create(false, images_)) {
        set_memory(memory_bytes);
        // Threads of its own would run out of memory on their own, and the others wait for their
        // tiles; all threads of a render look up and so decode
        OIIO::attribute("threads", 1);
        images_->attribute("autotile", 64);
        images_->attribute("automip", 1);
        images_->attribute("deduplicate", 0);
    }

    ~SystemSource() override {
        OIIO::TextureSystem::destroy(system_);
        OIIO::ImageCache::destroy(images_);
    }

    SystemSource(const SystemSource&) = delete;
    SystemSource& operator=(const SystemSource&) = delete;

    Result<std::unique_ptr<shading::TextureFile>> open(const std::string& file,
                                                       scene::SourceColorSpace space,
                                                       scene::Wrap wrap_s,
                                                       scene::Wrap wrap_t,
                                                       int max_side) override {
        try {
            const Result<FileFacts> facts = examine(sources_, file, space, max_side);
            if (!facts) return facts.error();
            return std::unique_ptr<shading::TextureFile>(
                new SystemFile(*system_, handle(file, *facts, max_side),
                               wrap_mode(wrap_s, *facts, false), wrap_mode(wrap_t, *facts, true)));
        } catch (const std::bad_alloc&) {
            throw;
        } catch (const std::exception& e) {
            return Error{"image-open", one_line(e.what())};
        }
    }

    std::string lookup_error() const override {
        std::string why = system_->geterror();
        if (why.empty()) why = SystemFile::thrown();
        return one_line(why);
    }

    size_t whole_bytes() const override { return whole_bytes_; }

    void set_memory(size_t bytes) override {
        images_->attribute("max_memory_MB", float(double(bytes) / (1 << 20)));
    }

    void drop_tiles() override { images_->invalidate_all(true); }

  private:
    /// Handle of one file in one decoding; the same file is cached once per decoding.
    Handle handle(const std::string& path, const FileFacts& facts, int max_side) {
        const bool decode = facts.is_srgb;
        const std::string name = (decode ? "velatura-srgb:" : "velatura-raw:") + path;
        const auto [it, is_new] = handles_.try_emplace(name, nullptr);
        if (is_new) {
            whole_bytes_ += facts.bytes;
            const OIIO::ImageSpec config =
                TextureInput::configuration(sources_, path, decode, max_side);
            images_->add_file(OIIO::ustring(name), TextureInput::create, &config);
            it->second = system_->get_texture_handle(OIIO::ustring(name));
        }
        return it->second;
    }

    ImageSource& sources_;
    OIIO::ImageCache* images_;
    OIIO::TextureSystem* system_;
    size_t whole_bytes_ = 0;
    std::unordered_map<std::string, Handle> handles_;
};

}  // namespace

Result<std::unique_ptr<shading::TextureSource>> TextureSystemFactory::make(
    size_t memory_bytes, const DecodeLimits& decoding) const {
    try {
        return std::unique_ptr<shading::TextureSource>(
            new SystemSource(select_image_source(decoding), memory_bytes));
    } catch (const std::exception& e) {
        return Error{"textures", e.what()};
    }
}

}  // namespace velatura::plugins::openimageio
