# docker build -t lampyris . && docker run --rm lampyris plan env-1
FROM python:3.11-slim
COPY pyproject.toml README.md LICENSE CHANGELOG.md /src/
COPY requirements/run.txt /src/requirements/run.txt
COPY src /src/src
RUN pip install --no-cache-dir -r /src/requirements/run.txt && pip install --no-cache-dir --no-deps /src && lampyris warm
RUN useradd --create-home lampyris
USER lampyris
WORKDIR /home/lampyris
ENTRYPOINT ["lampyris"]
