// A segment that its maker can still write after it is sealed.
#pragma once

#include <stdexcept>

#include "shm/segment.hpp"

namespace arbiter::test {

template <class Layout>
struct Written {
  Written()
      : descriptor(shm::make_segment("test", sizeof(Layout))),
        mapping(descriptor, sizeof(Layout), shm::Access::kReadWrite) {
    if (shm::allocate(descriptor, 0, sizeof(Layout))) throw std::runtime_error("no memory");
  }
  Layout& operator*() const { return *mapping.as<Layout>(); }
  Layout* operator->() const { return mapping.as<Layout>(); }

  shm::FileDescriptor descriptor;
  shm::Mapping mapping;
};

}  // namespace arbiter::test
