"""``lampyris maps``: maps, listed, shown, made, converted, and made of photographs."""
