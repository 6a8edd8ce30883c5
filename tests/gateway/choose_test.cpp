// Which of two sources a field of a sample chooses.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include "gateway/core/incoming.hpp"
#include "tests/gateway/foreign.hpp"

namespace arbiter::gateway {
namespace {

Choice choice_of(Field field, long double threshold, std::size_t offset = 0) {
  Choice choice;
  choice.field = field;
  choice.threshold = threshold;
  choice.offset = offset;
  return choice;
}

TEST(Choose, ComparesEachKindOfNumber) {
  const auto side = [](Field field, const std::string& bytes, long double threshold) {
    return choose(choice_of(field, threshold), BytesSample(bytes));
  };
  EXPECT_EQ(side(Field::kI8, bytes_of<std::int8_t>(-3), -4), Side::kYes);
  EXPECT_EQ(side(Field::kU8, bytes_of<std::uint8_t>(253), 252), Side::kYes);
  EXPECT_EQ(side(Field::kI16, bytes_of<std::int16_t>(-300), -300), Side::kNo);
  EXPECT_EQ(side(Field::kU16, bytes_of<std::uint16_t>(65535), 65534.5L), Side::kYes);
  EXPECT_EQ(side(Field::kI32, bytes_of<std::int32_t>(INT32_MIN), 0), Side::kNo);
  EXPECT_EQ(side(Field::kU32, bytes_of<std::uint32_t>(UINT32_MAX), 0), Side::kYes);
  EXPECT_EQ(side(Field::kI64, bytes_of<std::int64_t>(INT64_MAX), INT64_MAX - 1), Side::kYes);
  EXPECT_EQ(side(Field::kU64, bytes_of<std::uint64_t>(UINT64_MAX), UINT64_MAX), Side::kNo);
  EXPECT_EQ(side(Field::kF32, bytes_of<float>(0.5F), 0.25L), Side::kYes);
  EXPECT_EQ(side(Field::kF64, bytes_of<double>(-INFINITY), 0), Side::kNo);
  EXPECT_EQ(side(Field::kF64, bytes_of<double>(1e300), 1e300L), Side::kNo);
  EXPECT_EQ(side(Field::kF32, bytes_of<float>(0.1F), 0.1L), Side::kNo);
}

TEST(Choose, NothingIsChosenByNaNOrAShortSample) {
  EXPECT_FALSE(choose(choice_of(Field::kF32, 0), BytesSample(bytes_of<float>(NAN))));
  EXPECT_FALSE(choose(choice_of(Field::kF64, 0), BytesSample(bytes_of<double>(-NAN))));
  EXPECT_FALSE(choose(choice_of(Field::kF64, 0), BytesSample("1234567")));
  EXPECT_FALSE(choose(choice_of(Field::kF64, 0, 1), BytesSample("12345678")));
  EXPECT_FALSE(choose(choice_of(Field::kU8, 0, SIZE_MAX), BytesSample("12345678")));
  EXPECT_FALSE(choose(choice_of(Field::kU8, 0), BytesSample("1234", 5)));
}

TEST(Choose, FieldsAreReadInTheSamplesByteOrder) {
  const std::string number("\0\0\1\0", 4);
  EXPECT_EQ(choose(choice_of(Field::kU32, 256), BytesSample(number, 0, true)), Side::kNo);
  EXPECT_EQ(choose(choice_of(Field::kU32, 255), BytesSample(number, 0, true)), Side::kYes);
  EXPECT_EQ(choose(choice_of(Field::kU32, 65535), BytesSample(number)), Side::kYes);
  EXPECT_EQ(choose(choice_of(Field::kU32, 65536), BytesSample(number)), Side::kNo);
}

}  // namespace
}  // namespace arbiter::gateway
