#include "bench/harness/build_info.hpp"

#include <gnu/libc-version.h>
#include <link.h>

#include <algorithm>
#include <filesystem>

#include <boost/version.hpp>

#include "bench_commit.hpp"  // made at each build

namespace arbiter::bench {
namespace {

int add_library(dl_phdr_info* info, std::size_t, void* data) {
  const std::string name = info->dlpi_name == nullptr ? "" : info->dlpi_name;
  if (name.find('/') == std::string::npos) return 0;  // the program itself, or the kernel's
  std::error_code ignored;
  const auto file = std::filesystem::canonical(name, ignored);  // "libx.so.5" is "libx.so.5.2.4"
  static_cast<std::vector<std::string>*>(data)->push_back(file.filename());
  return 0;
}

std::vector<std::string> libraries() {
  std::vector<std::string> found;
  ::dl_iterate_phdr(add_library, &found);
  std::sort(found.begin(), found.end());
  found.insert(found.begin(), {"glibc " + std::string(::gnu_get_libc_version()),
                               "Boost " + std::to_string(BOOST_VERSION / 100000) + "." +
                                   std::to_string(BOOST_VERSION / 100 % 1000)});
  return found;
}

}  // namespace

BuildInfo build_info() {
  BuildInfo info;
  info.version = ARBITER_VERSION;
  info.commit = ARBITER_COMMIT;
#ifdef __clang__
  info.compiler = __VERSION__;
#else
  info.compiler = std::string("GCC ") + __VERSION__;
#endif
  info.type = ARBITER_BUILD_TYPE;
  info.flags = ARBITER_BUILD_FLAGS;
#ifdef __OPTIMIZE__
  info.is_optimised = true;
#endif
  info.sanitizer = ARBITER_SANITIZER;
  info.libraries = libraries();
  return info;
}

}  // namespace arbiter::bench
