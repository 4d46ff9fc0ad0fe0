// What a scene's exposure and view transform make of a radiance, as light that the display then encodes by sRGB's curve.
// `shaper`: exposure as a factor, scale k of log2(1 + k x), that of the table's largest x, side of the table; the side
// is 0 where the transform is Standard, which shows light as it is up to 1.
vec3 from_srgb(vec3 c)
{
  return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), greaterThan(c, vec3(0.04045)));
}

vec3 displayed(vec3 radiance)
{
  vec3 x = max(radiance * shaper.x, vec3(0.0));
  if (shaper.w == 0.0) {
    return min(x, vec3(1.0));
  }
  vec3 at = min(log2(1.0 + shaper.y * x) / shaper.z, vec3(1.0));
  return from_srgb(texture(transform, (at * (shaper.w - 1.0) + 0.5) / shaper.w).rgb);
}
