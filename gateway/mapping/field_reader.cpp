#include "gateway/mapping/field_reader.hpp"

#include "gateway/mapping/ros_names.hpp"

namespace arbiter::gateway {
namespace {

// Of a common type of ROS 2 where nothing can choose, or not at that place.
bool cannot_choose(Attributes& attributes, const SampleShape& shape, const Choice& choice) {
  const bool is_empty = shape.type == "std_msgs/msg/Empty";
  if (is_empty || shape.type == "std_msgs/msg/String") {
    attributes.error("invalid-value", "type",
                     "a " + shape.type + (is_empty ? " says nothing" : " is a text of any length") +
                         ", so that nothing in it can choose between two sources; write "
                         "port=\"…\" in place of the two, or map a topic of another type");
    return true;
  }
  if (!has_header(shape.type) || choice.offset >= kLeastHeader) return false;
  attributes.error("invalid-value", attributes.has("offset") ? "offset" : "type",
                   "a " + shape.type + " begins with a header of " + bytes_text(kLeastHeader) +
                       " or more, which cannot choose between two sources; say with "
                       "offset=\"…\" where the field is behind it, in each sample");
  return true;
}

// The common types of ROS 2 have fields of one kind each.
bool check_kind(Attributes& attributes, const SampleShape& shape, const Choice& choice) {
  if (shape.is_dds && cannot_choose(attributes, shape, choice)) return false;
  const bool is_boolean = choice.field == Field::kBoolean;
  if (is_boolean && (attributes.has("above") || attributes.has("below"))) {
    return false;  // the field was refused
  }
  const Field known = shape.is_dds ? field_of(shape.type).value_or(choice.field) : choice.field;
  if (known == choice.field) return true;
  attributes.error(
      "invalid-value", is_boolean ? "type" : "field",
      "the fields of a " + shape.type + " are " + name_of(known) + ", not " +
          name_of(choice.field) +
          (known == Field::kBoolean ? std::string("; write true=\"…\" and false=\"…\"")
           : is_boolean ? std::string("; write above=\"…\", below=\"…\", a threshold and "
                                      "field=\"") +
                              name_of(known) + '"'
                        : std::string("; write field=\"") + name_of(known) + '"'));
  return false;
}

// A field that no sample has would leave both sources silent for ever.
void check_place(Attributes& attributes, const SampleShape& shape, const Choice& choice) {
  if (!check_kind(attributes, shape, choice)) return;
  const std::size_t size = size_of(choice.field);
  const std::size_t end = choice.offset + size;
  const std::string at = attributes.has("offset") ? "offset" : "field";
  if (shape.header + end > shape.max_size) {
    attributes.error("invalid-value", at,
                     "the field lies beyond max_size, " + std::to_string(shape.max_size) +
                         " bytes; correct one of the two");
  } else if (shape.size && end > *shape.size) {
    attributes.error("invalid-value", at,
                     (shape.type.empty() ? std::string("a sample") : "a " + shape.type) + " has " +
                         bytes_text(*shape.size) + ", and the field would end at " +
                         std::to_string(end) + "; correct the offset or the field");
  }
}

void check_threshold(Attributes& attributes, const Choice& choice) {
  const Range range = range_of(choice.field);
  const bool is_always = choice.threshold < range.least;
  // Of a floating-point number infinity is above all others.
  const bool is_floating = choice.field == Field::kF32 || choice.field == Field::kF64;
  const bool is_below =
      choice.threshold < range.greatest || (is_floating && choice.threshold == range.greatest);
  if (!is_always && is_below) return;
  attributes.error("invalid-value", "threshold",
                   std::string("each number of this field is ") +
                       (is_always ? "above it" : "at or below it") +
                       ", so one of the two sources would never be active; write another "
                       "threshold, or correct the field");
}

void read_number(Attributes& attributes, Choice& choice) {
  attributes.required("field", 100);
  using enum Field;
  const auto field = attributes.word<Field>("field", {{"f32", kF32},
                                                      {"f64", kF64},
                                                      {"i8", kI8},
                                                      {"u8", kU8},
                                                      {"i16", kI16},
                                                      {"u16", kU16},
                                                      {"i32", kI32},
                                                      {"u32", kU32},
                                                      {"i64", kI64},
                                                      {"u64", kU64}});
  if (field) choice.field = *field;
  attributes.required("threshold", 100);
  const auto threshold = attributes.real("threshold");
  if (threshold) choice.threshold = *threshold;
  if (field && threshold) check_threshold(attributes, choice);
}

}  // namespace

Choice read_field(Attributes& attributes, const SampleShape& shape) {
  Choice choice;
  if (const auto offset = attributes.bytes("offset", 0, kMaxSampleBytes)) choice.offset = *offset;
  if (attributes.has("above") || attributes.has("below")) read_number(attributes, choice);
  check_place(attributes, shape, choice);
  return choice;
}

}  // namespace arbiter::gateway
