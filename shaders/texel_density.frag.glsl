// A checker of one square a texel, of 8 x 8 texels where those are too small to see, or plain where these are too.
// Blue: half as many texels a meter as asked for, or fewer; green: as many; red: twice as many, or more.
const vec3 FEW = vec3(0.05, 0.2, 0.9), AS_ASKED = vec3(0.1, 0.65, 0.15), MANY = vec3(0.9, 0.12, 0.05);

void main()
{
  float octaves = clamp(log2(max(ratio_at, 1e-6)), -1.0, 1.0);
  vec3 base = mix(AS_ASKED, octaves < 0.0 ? FEW : MANY, abs(octaves));
  vec2 texels_of_pixel = fwidth(texel_at);
  float widest = max(texels_of_pixel.x, texels_of_pixel.y);
  float block = widest < 0.25 ? 1.0 : 8.0;
  vec2 square = floor(texel_at / block);
  float odd = mod(square.x + square.y, 2.0);
  float contrast = widest < 2.0 ? 0.35 : 0.0;
  color = vec4(base * (1.0 - contrast * odd), 0.85);
}
