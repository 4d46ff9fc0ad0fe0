// The world behind everything. Needs view_transform and sky_color.
void main()
{
  color = vec4(mode == 0 ? displayed(sky_color(toward_at)) : vec3(0.0), 1.0);
}
