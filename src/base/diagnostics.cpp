// SPDX-License-Identifier: Apache-2.0
#include "base/diagnostics.h"

#include "base/hash.h"

#include <fmt/format.h>

namespace velatura {

namespace {

const char* severity_word(Severity s) {
    switch (s) {
        case Severity::Note:
            return "note";
        case Severity::Warning:
            return "warning";
        case Severity::Error:
            return "error";
    }
    return "error";
}

/// Names come from scenes: bytes that would move a terminal's cursor, or begin a line of their own,
/// become "\\x1b".
std::string printable(std::string_view text) {
    std::string out;
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte < 0x20 || byte == 0x7f) {
            out += fmt::format("\\x{:02x}", byte);
        } else {
            out += c;
        }
    }
    return out;
}

uint64_t identity(const Diagnostic& d) {
    uint64_t h = hash_string(d.code);
    h = hash_combine(h, hash_string(d.prim_path));
    h = hash_combine(h, hash_string(d.message));
    h = hash_combine(h,
                     (uint64_t(d.loc.file_id) << 40) ^ (uint64_t(d.loc.line) << 16) ^ d.loc.column);
    return h;
}

}  // namespace

void LateDiagnostics::add(Diagnostic d) const {
    if (!link_) return;
    const std::lock_guard lock(link_->mutex);
    if (link_->target) link_->target->add(std::move(d));
}

Diagnostics::~Diagnostics() {
    if (!late_link_) return;
    const std::lock_guard lock(late_link_->mutex);
    late_link_->target = nullptr;
}

LateDiagnostics Diagnostics::late() {
    if (target_) return target_->late();
    const std::lock_guard lock(mutex_);
    if (!late_link_) {
        late_link_ = std::make_shared<LateDiagnostics::Link>();
        late_link_->target = this;
    }
    LateDiagnostics result;
    result.link_ = late_link_;
    return result;
}

uint32_t Diagnostics::file_id(std::string_view file_name) {
    if (target_) return target_->file_id(file_name);
    std::lock_guard lock(mutex_);
    auto [it, is_new] = file_ids_.try_emplace(std::string(file_name), uint32_t(files_.size() + 1));
    if (is_new) files_.emplace_back(file_name);
    return it->second;
}

std::string Diagnostics::file_name_locked(uint32_t id) const {
    return id == 0 || id > files_.size() ? std::string() : files_[id - 1];
}

std::string Diagnostics::file_name(uint32_t id) const {
    if (target_) return target_->file_name(id);
    std::lock_guard lock(mutex_);
    return file_name_locked(id);
}

void Diagnostics::forward() {
    std::lock_guard lock(mutex_);
    is_forwarding_ = true;
    for (Diagnostic& d : held_) target_->add(std::move(d));
    held_.clear();
}

void Diagnostics::add(Diagnostic d) {
    std::lock_guard lock(mutex_);
    if (target_) {
        if (d.severity == Severity::Error) ++errors_;
        if (d.severity == Severity::Warning) ++warnings_;
        if (is_forwarding_) {
            target_->add(std::move(d));
        } else {
            held_.push_back(std::move(d));
        }
        return;
    }
    if (d.severity == Severity::Error) ++errors_;
    if (d.severity == Severity::Warning) ++warnings_;
    if (++seen_[identity(d)] > 1) return;
    if (++code_counts_[d.code] > per_code_limit) {
        ++dropped_[d.code];
        return;
    }
    entries_.push_back(std::move(d));
    if (listener_) listener_(entries_.back());
}

void Diagnostics::note(std::string code,
                       SourceLoc loc,
                       std::string prim_path,
                       std::string message) {
    add({Severity::Note, std::move(code), loc, std::move(prim_path), std::move(message), {}});
}

void Diagnostics::warn(std::string code,
                       SourceLoc loc,
                       std::string prim_path,
                       std::string message) {
    add({Severity::Warning, std::move(code), loc, std::move(prim_path), std::move(message), {}});
}

void Diagnostics::error(std::string code,
                        SourceLoc loc,
                        std::string prim_path,
                        std::string message) {
    add({Severity::Error, std::move(code), loc, std::move(prim_path), std::move(message), {}});
}

size_t Diagnostics::error_count() const {
    std::lock_guard lock(mutex_);
    return errors_;
}

size_t Diagnostics::warning_count() const {
    std::lock_guard lock(mutex_);
    return warnings_;
}

std::vector<Diagnostic> Diagnostics::all() const {
    std::lock_guard lock(mutex_);
    return entries_;
}

std::unordered_map<std::string, size_t> Diagnostics::dropped() const {
    std::lock_guard lock(mutex_);
    return dropped_;
}

void Diagnostics::set_listener(std::function<void(const Diagnostic&)> listener) {
    std::lock_guard lock(mutex_);
    listener_ = std::move(listener);
}

std::string Diagnostics::format(const Diagnostic& d) const {
    std::string out;
    const std::string file = printable(file_name(d.loc.file_id));
    if (!file.empty()) {
        out += file;
        if (d.loc.line > 0) out += fmt::format(":{}:{}", d.loc.line, d.loc.column);
        out += ": ";
    }
    out += fmt::format("{}: {} [{}]", severity_word(d.severity), printable(d.message), d.code);
    if (!d.prim_path.empty()) out += fmt::format("\n  note: at <{}>", printable(d.prim_path));
    for (const std::string& n : d.notes) out += "\n  note: " + printable(n);
    return out;
}

}  // namespace velatura
