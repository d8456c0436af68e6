// SPDX-License-Identifier: Apache-2.0
#include "plugin/manifest.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace velatura::plugin {

namespace {

constexpr std::string_view blanks = " \t\r";

// A piece of a line and where it starts, from 0.
struct Piece {
    std::string_view text;
    size_t column = 0;
};

Piece trim(Piece piece) {
    const size_t begin = std::min(piece.text.find_first_not_of(blanks), piece.text.size());
    piece.text.remove_prefix(begin);
    piece.column += begin;
    const size_t end = piece.text.find_last_not_of(blanks);
    piece.text = piece.text.substr(0, end == std::string_view::npos ? 0 : end + 1);
    return piece;
}

// Splits after the first `size` characters.
Piece rest_of(const Piece& piece, size_t size) {
    return trim({piece.text.substr(size), piece.column + size});
}

bool is_word(std::string_view text, std::string_view more) {
    return !text.empty() && std::all_of(text.begin(), text.end(), [&](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
               more.find(c) != std::string_view::npos;
    });
}

bool is_name(std::string_view text) {
    return is_word(text, "_-");
}

// A file name without folders, which cannot lead out of the manifest's own.
bool is_file_name(std::string_view text) {
    return is_word(text, "_-.+") && text[0] != '.';
}

bool is_printable(std::string_view text) {
    return std::none_of(text.begin(), text.end(), [](char c) {
        const auto byte = static_cast<unsigned char>(c);
        return (byte < 0x20 && c != '\t') || byte == 0x7f;
    });
}

class ManifestParser {
  public:
    ManifestParser(const std::string& file_name, Diagnostics& diagnostics)
        : file_name_(file_name), diagnostics_(diagnostics) {
        const size_t slash = file_name.rfind('/');
        manifest_.folder = slash == std::string::npos ? "." : file_name.substr(0, slash);
    }

    std::optional<Manifest> run(std::string_view text) {
        while (!text.empty()) {
            ++line_;
            const size_t end = text.find('\n');
            parse_line(trim({text.substr(0, end), 0}));
            text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
        }
        require(!manifest_.name.empty(), "name");
        require(manifest_.abi != 0, "abi");
        require(!manifest_.provides.empty(), "provides");
        require(!manifest_.triggers.empty(), "trigger");
        if (has_failed_) return std::nullopt;
        if (manifest_.library.empty()) manifest_.library = "velatura_" + manifest_.name + ".so";
        return std::move(manifest_);
    }

  private:
    SourceLoc at(size_t column) {
        return {diagnostics_.file_id(file_name_), uint32_t(std::max<size_t>(line_, 1)),
                uint32_t(column + 1)};
    }

    void fail(size_t column, std::string message) {
        has_failed_ = true;
        diagnostics_.error("plugin-manifest", at(column), {}, std::move(message));
    }

    // Lines that were there but wrong have been reported
    void require(bool is_there, const char* key) {
        if (!is_there && !has_failed_)
            fail(0, fmt::format("expected a line \"{}: …\", found none", key));
    }

    void parse_line(const Piece& line) {
        if (line.text.empty() || line.text[0] == '#') return;
        const size_t colon = line.text.find(':');
        const Piece key =
            trim({line.text.substr(0, std::min(colon, line.text.size())), line.column});
        if (!is_printable(line.text))
            return fail(line.column, "expected text, found control characters");
        if (colon == std::string_view::npos)
            return fail(line.column,
                        fmt::format("expected \"key: value\", found \"{}\"", line.text));
        const Piece value = rest_of(line, colon + 1);
        if (value.text.empty())
            return fail(line.column + colon + 1,
                        fmt::format("expected a value of {}, found nothing", key.text));
        set(key, value);
    }

    void set(const Piece& key, const Piece& value) {
        if (key.text == "name")
            return set_once(manifest_.name, key, value, is_name,
                            "a name of letters, digits, _ and -");
        if (key.text == "library")
            return set_once(manifest_.library, key, value, is_file_name,
                            "a file name without folders");
        if (key.text == "summary")
            return set_once(manifest_.summary, key, value, is_printable, "one line of text");
        if (key.text == "abi") return set_abi(key, value);
        if (key.text == "memory") return set_memory(key, value);
        if (key.text == "provides") return add_interface(value);
        if (key.text == "trigger") return add_trigger(value);
        fail(key.column, fmt::format("expected one of name, abi, library, provides, trigger, "
                                     "memory, summary, found \"{}\"",
                                     key.text));
    }

    void set_once(std::string& to,
                  const Piece& key,
                  const Piece& value,
                  bool (*is_good)(std::string_view),
                  const char* wanted) {
        if (!to.empty())
            return fail(key.column, fmt::format("expected one {}, found another", key.text));
        if (!is_good(value.text))
            return fail(value.column, fmt::format("expected {}, found \"{}\"", wanted, value.text));
        to = value.text;
        if (key.text == "name") manifest_.loc = at(value.column);
    }

    void set_abi(const Piece& key, const Piece& value) {
        if (manifest_.abi != 0) return fail(key.column, "expected one abi, found another");
        const char* end = value.text.data() + value.text.size();
        const auto parsed = std::from_chars(value.text.data(), end, manifest_.abi);
        if (parsed.ec == std::errc() && parsed.ptr == end && manifest_.abi > 0) {
            manifest_.abi_loc = at(value.column);
            return;
        }
        manifest_.abi = 0;
        fail(value.column,
             fmt::format("expected a number from 1 to {}, found \"{}\"", UINT32_MAX, value.text));
    }

    void set_memory(const Piece& key, const Piece& value) {
        if (manifest_.memory_bytes != 0)
            return fail(key.column, "expected one memory, found another");
        constexpr size_t megabyte = 1000000, max = 100000;
        size_t megabytes = 0;
        const char* end = value.text.data() + value.text.size();
        const auto parsed = std::from_chars(value.text.data(), end, megabytes);
        if (parsed.ec != std::errc() || parsed.ptr != end || megabytes == 0 || megabytes > max)
            return fail(value.column, fmt::format("expected megabytes from 1 to {}, found \"{}\"",
                                                  max, value.text));
        manifest_.memory_bytes = megabytes * megabyte;
    }

    void add_interface(const Piece& value) {
        if (!is_name(value.text))
            return fail(value.column,
                        fmt::format("expected the name of an interface, found \"{}\"", value.text));
        if (manifest_.has_interface(value.text))
            return fail(value.column,
                        fmt::format("expected another interface, found \"{}\" again", value.text));
        manifest_.provides.emplace_back(value.text);
    }

    void add_trigger(const Piece& value) {
        const size_t blank = std::min(value.text.find_first_of(blanks), value.text.size());
        const Piece wanted = rest_of(value, blank);
        const std::string_view kind = value.text.substr(0, blank);
        if (!is_name(kind) || wanted.text.empty())
            return fail(
                value.column,
                fmt::format("expected a kind and a value such as \"prim_type Cube\", found \"{}\"",
                            value.text));
        manifest_.triggers.push_back({std::string(kind), std::string(wanted.text)});
    }

    std::string file_name_;
    Diagnostics& diagnostics_;
    Manifest manifest_;
    size_t line_ = 0;
    bool has_failed_ = false;
};

}  // namespace

bool Manifest::has_trigger(const Trigger& trigger) const {
    return std::find(triggers.begin(), triggers.end(), trigger) != triggers.end();
}

bool Manifest::has_interface(std::string_view interface_name) const {
    return std::find(provides.begin(), provides.end(), interface_name) != provides.end();
}

std::optional<Manifest> parse_manifest(std::string_view text,
                                       const std::string& file_name,
                                       Diagnostics& diagnostics) {
    return ManifestParser(file_name, diagnostics).run(text);
}

}  // namespace velatura::plugin
