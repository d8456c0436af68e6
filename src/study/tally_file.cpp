// SPDX-License-Identifier: Apache-2.0
// Tallies as bytes: numbers of the machine one after the other, between the fingerprint and a hash
// of it all.
#include "base/hash.h"
#include "study/tally.h"

#include <cstring>
#include <type_traits>

namespace velatura::study {

namespace {

class Writer {
  public:
    template <class T>
    requires std::is_arithmetic_v<T>

    void value(T& v) { bytes.append(reinterpret_cast<const char*>(&v), sizeof v); }

    template <class List>
    void size_of(List& list) {
        uint64_t n = list.size();
        value(n);
    }

    template <class T>
    requires std::is_arithmetic_v<T>

    void numbers(T* first, size_t count) {
        bytes.append(reinterpret_cast<const char*>(first), count * sizeof(T));
    }

    std::string bytes;
};

class Reader {
  public:
    explicit Reader(std::string_view b) : bytes(b) {}

    template <class T>
    requires std::is_arithmetic_v<T>

    void value(T& v) { numbers(&v, 1); }

    template <class List>
    void size_of(List& list) {
        uint64_t n = 0;
        value(n);
        // Every element takes a byte at least
        is_good = is_good && n <= bytes.size();
        list.resize(is_good ? n : 0);
    }

    template <class T>
    requires std::is_arithmetic_v<T>

    void numbers(T* first, size_t count) {
        is_good = is_good && count <= bytes.size() / sizeof(T);
        // An empty list has no place to copy to
        if (!is_good || count == 0) return;
        std::memcpy(first, bytes.data(), count * sizeof(T));
        bytes.remove_prefix(count * sizeof(T));
    }

    std::string_view bytes;
    bool is_good = true;
};

template <class File, class List>
void list(File& file, List& values) {
    file.size_of(values);
    file.numbers(values.data(), values.size());
}

template <class File>
void moments(File& file, Moments& m) {
    list(file, m.sum);
    list(file, m.square);
    file.value(m.count);
}

template <class File>
void all(File& file, Tallies& t) {
    file.value(t.grid.width);
    file.value(t.grid.height);
    file.value(t.rounds);
    file.value(t.elapsed_s);
    file.size_of(t.settings);
    for (SettingTally& s : t.settings) {
        file.size_of(s.points);
        for (PointTally& p : s.points) {
            file.value(p.spp);
            moments(file, p.image);
            list(file, p.cpu_s);
            file.value(p.rays);
        }
        moments(file, s.difference);
        list(file, s.rounds);
        file.value(s.setup_s);
        file.value(s.outline_px);
        list(file, s.rejection);
    }
    file.size_of(t.layers);
    for (LayerTally& l : t.layers) {
        file.value(l.is_bounce);
        list(file, l.name);
        moments(file, l.image);
    }
    moments(file, t.pixel_s);
}

std::string head(const std::string& fingerprint) {
    return "velatura.study.state/1 " + fingerprint + "\n";
}

}  // namespace

std::string to_bytes(const Tallies& tallies, const std::string& fingerprint) {
    Writer writer;
    Tallies copy = tallies;
    all(writer, copy);
    uint64_t hash = hash_string(writer.bytes);
    writer.value(hash);
    return head(fingerprint) + writer.bytes;
}

std::optional<Tallies> from_bytes(const std::string& bytes, const std::string& fingerprint) {
    const std::string expected = head(fingerprint);
    uint64_t hash = 0;
    if (!bytes.starts_with(expected) || bytes.size() < expected.size() + sizeof hash)
        return std::nullopt;
    std::memcpy(&hash, bytes.data() + bytes.size() - sizeof hash, sizeof hash);
    const std::string_view body(bytes.data() + expected.size(),
                                bytes.size() - expected.size() - sizeof hash);
    if (hash_string(body) != hash) return std::nullopt;
    Reader reader(body);
    Tallies t;
    all(reader, t);
    if (!reader.is_good || !reader.bytes.empty()) return std::nullopt;
    return t;
}

}  // namespace velatura::study
