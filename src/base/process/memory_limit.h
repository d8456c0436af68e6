// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace velatura {
inline namespace process {

/// Memory that this process has resident, in bytes: what counts against it, files that are mapped
/// included.
size_t resident_bytes();

/// The most that it ever had resident since its program was started.
size_t peak_resident_bytes();

/// Physical memory of the machine, bytes.
size_t machine_bytes();

/// Puts memory aside, which operator new gets when it finds no other: what must not throw,
/// destructors of libraries among it, and whoever says what happened still have some then. For
/// programs to call once, at the begin of main().
void reserve_memory();

/// Keeps the resident memory of this process below a limit while the object lives; one at a time.
/// In two ways by turns: enforced, the kernel refuses what would go beyond it, so that allocations
/// throw std::bad_alloc before the memory is there (setrlimit(2), RLIMIT_DATA); watched, somebody
/// asks for left() while memory is taken so little by little that what is there can be put away in
/// time. Starts enforced. enforce() and watch() belong to one thread, the others to all.
class MemoryLimit {
  public:
    /// Throws std::bad_alloc when the process is above the limit already, or nearer than
    /// kept_bytes: its own code would pass it.
    explicit MemoryLimit(size_t bytes);
    ~MemoryLimit();
    MemoryLimit(const MemoryLimit&) = delete;
    MemoryLimit& operator=(const MemoryLimit&) = delete;

    /// Gives what was freed back to the kernel, which grants no more than what is left from here
    /// on. To be called again after files were mapped or libraries opened, whose pages the kernel
    /// does not count. Without a limit nothing happens. `doing`: for messages, "while …"; a
    /// literal.
    static void enforce(const char* doing);
    static void watch();

    /// Gives memory that was freed back to the kernel.
    static void give_back();

    /// Suspends enforcement while it lives: for code that cannot handle failed allocations, such as
    /// the threads that libraries start when they are opened.
    class Suspension {
      public:
        Suspension();
        /// Enforces the limit again if it was enforced before: allocations fail at once when too
        /// much was taken.
        ~Suspension();
        Suspension(const Suspension&) = delete;
        Suspension& operator=(const Suspension&) = delete;

      private:
        bool was_enforced_;
    };

    /// Exempts operator new of this thread from the limit while it lives, up to 256 MB above it:
    /// for libraries whose failed allocations would leave other threads waiting. Larger requests,
    /// as of a damaged file, fail. Cost: two additions.
    class Exemption {
      public:
        Exemption() {
            if (depth++ == 0) steps = 0;
        }

        ~Exemption() { --depth; }

        Exemption(const Exemption&) = delete;
        Exemption& operator=(const Exemption&) = delete;

      private:
        friend class MemoryLimit;
        inline static thread_local int depth = 0, steps = 0;
    };

    /// What enforce() keeps of what is left: pages of libraries that come in when code runs for the
    /// first time, the kernel's counters, which lag behind by up to 64 pages a thread, and what is
    /// put aside.
    static constexpr size_t kept_bytes = size_t(10) << 20;

    /// For operator new of a program: it found no memory for this many bytes, and will ask for
    /// more memory or throw.
    static void note_rejection(size_t bytes);
    /// Of the last rejection; 0: none, or not of operator new.
    static size_t refused_bytes();

    static bool is_set();
    /// What enforce() was told last.
    static const char* doing();

    /// What the process may have resident: the limit, else the machine's memory, in bytes.
    static size_t allowed();
    /// allowed() less what is resident, 0 at least.
    static size_t left();

  private:
    friend void reserve_memory();
    static void find_memory_or_throw();
};

}  // namespace process
}  // namespace velatura
