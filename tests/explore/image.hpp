// The memory of a scenario: the objects under test, all that they allocate, and the segments that
// they share. It is built once; then each execution begins with the very same bytes, at the very
// same addresses, however the last one ended.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

namespace arbiter::explore {

// One at a time. Not thread-safe.
class Image {
 public:
  // Allocations come from the image while one of these lives, if there is an image.
  class Inside {
   public:
    Inside() noexcept : before_(std::exchange(inside_, exists_)) {}
    Inside(const Inside&) = delete;
    Inside& operator=(const Inside&) = delete;
    ~Inside() { inside_ = before_; }

   private:
    const bool before_;
  };
  class Outside {
   public:
    Outside() noexcept : before_(std::exchange(inside_, false)) {}
    Outside(const Outside&) = delete;
    Outside& operator=(const Outside&) = delete;
    ~Outside() { inside_ = before_; }

   private:
    const bool before_;
  };

  Image();
  Image(const Image&) = delete;
  Image& operator=(const Image&) = delete;
  ~Image();

  // What is there now is what each execution begins with.
  void take();
  // Copies back the pages that were written since.
  void restore();

  // Zeroed pages, for a segment.
  static std::byte* allocate_pages(std::size_t size);

  // What a thread was inside of is void when its execution ends before it.
  static void leave() noexcept { inside_ = false; }

  // For operator new and delete.
  static bool is_inside() noexcept { return inside_; }
  static void* allocate(std::size_t size, std::size_t alignment);
  static bool owns(const void* address) noexcept;
  // Whether it lies in a segment.
  static bool is_segment(const void* address) noexcept;

 private:
  static inline bool exists_ = false;
  static inline bool inside_ = false;
};

// A T, with all that it owns, in an image.
template <class T>
class Restored {
 public:
  template <class... Arguments>
  explicit Restored(Arguments&&... arguments) {
    {
      const Image::Inside inside;
      object_ = new T(std::forward<Arguments>(arguments)...);
    }
    image_.take();
  }
  Restored(const Restored&) = delete;
  Restored& operator=(const Restored&) = delete;
  ~Restored() {
    image_.restore();
    delete object_;
  }

  T& restore() {
    image_.restore();
    return *object_;
  }
  T& operator*() { return *object_; }

 private:
  Image image_;
  T* object_;
};

}  // namespace arbiter::explore
