// Base color times light, and emission. Needs view_transform and material.
// mode: 0 light and color, 1 indirect light alone, 2 light alone.
void main()
{
  vec2 uv_dx = dFdx(uv_at), uv_dy = dFdy(uv_at);
  int row = 3 * material_at;
  if (!shows(of_material(row + 2, uv_at, uv_dx, uv_dy).x)) {
    discard;
  }
  vec3 base = mode == 0 ? of_material(row, uv_at, uv_dx, uv_dy) : vec3(1.0);
  vec3 emitted = mode == 1 ? vec3(0.0) : of_material(row + 1, uv_at, uv_dx, uv_dy);
  vec3 light = indirect_at + (mode == 1 ? vec3(0.0) : direct_at);
  color = vec4(displayed(base * light + emitted), 1.0);
}
